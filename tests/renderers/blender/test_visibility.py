"""Faces behind pixels: against rays that OpenCV undistorts and Embree casts, neither knowing Blender."""

from dataclasses import replace

import cv2
import numpy as np
import psutil
import pytest
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from spin_usd.errors import RenderError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.blender.passes import face_indices
from spin_usd.renderers.camera_shader import PLAIN_FOCAL, View
from spin_usd.scene.effort import Effort
from tests.cases.scenes import with_first

EDGE_PX = 1e-3  # how near an edge float32 (Blender's and Embree's own) may take a ray to the other side
PLAIN_PX = 1e-3  # what Blender's own camera may miss the centres by: 0.0005 px as it is made, the rest is float32's
SHADER_PX = 4e-4  # less than that: the shader sends those rays through the centre
BOUNDARY_PIXELS = 2  # silhouette pixels of a picture that may lie so near an edge
MEMORY_GROWTH = 24 << 20  # bytes over 200 frames; allocators keep some of what is freed, a leaked mesh would be 100 MB
POSES = [((1, 0, 0, 0), (0, 0, 4)), ((0.5, -0.3, 0.7, 0.2), (0.3, -0.2, 3)), ((0.1, 0.9, -0.2, 0.4), (-0.7, 0.4, 5))]


def opencv_rays(camera, region):
    """Directions (rows, columns, 3), z = 1, of the pixel centres, by OpenCV's own undistortion."""
    u, v = np.meshgrid(np.arange(region.x0, region.x1) + 0.5, np.arange(region.y0, region.y1) + 0.5)
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-15)
    pixels = np.stack([u.ravel(), v.ravel()], -1)[:, None]
    xy = cv2.undistortPoints(pixels, camera.matrix, np.array(camera.distortion), criteria=stop)
    return np.concatenate([xy.reshape(*region.shape, 2), np.ones((*region.shape, 1))], -1)


def embree_faces(scene, rays):
    """First face (rows, columns) that each ray from the camera meets; -1 for none.

    Cast from just before the target, in axes at its centre, so that Embree's float32 has the target's own size.
    """
    mesh, pose = scene.target.mesh, scene.T_cam_body
    centre = pose.points(mesh.centre)
    caster = RayMeshIntersector(trimesh.Trimesh(pose.points(mesh.points) - centre, mesh.faces, process=False))
    flat = rays.reshape(-1, 3)
    towards = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    if np.linalg.norm(centre) < 2 * mesh.radius:
        start = np.broadcast_to(-centre, flat.shape)
    else:
        meets = (flat - centre / centre[2]) * centre[2]
        start = meets - ((meets * towards).sum(1, keepdims=True) + 1.01 * mesh.radius) * towards
    return caster.intersects_first(start, towards).reshape(rays.shape[:2])


def edge_distance(scene, row, column, faces):
    """Pixels from the pixel's centre to the nearest edge of the faces, projected by OpenCV, in double precision."""
    mesh, camera = scene.target.mesh, scene.camera
    corners = scene.T_cam_body.points(mesh.points[mesh.faces[faces]]).reshape(-1, 3)
    uv = cv2.projectPoints(corners, np.zeros(3), np.zeros(3), camera.matrix, np.array(camera.distortion))[0]
    a = uv.reshape(-1, 3, 2) - (column + 0.5, row + 0.5)
    along = np.roll(a, -1, axis=1) - a
    s = np.clip(-(a * along).sum(-1) / np.maximum((along**2).sum(-1), 1e-300), 0, 1)
    return np.linalg.norm(a + s[..., None] * along, axis=-1).min()


def assert_sees_what_embree_sees(blender, scene) -> None:
    seen = blender.visibility(scene)
    rays = opencv_rays(scene.camera, seen.region)
    expected = embree_faces(scene, rays)
    assert (expected >= 0).sum() > 500  # there is something to see
    differ = seen.face != expected
    for row, column in np.argwhere(differ):
        faces = [f for f in (seen.face[row, column], expected[row, column]) if f >= 0]
        row, column = row + seen.region.y0, column + seen.region.x0
        assert edge_distance(scene, row, column, faces) < EDGE_PX, (row, column, faces)
    assert ((seen.face >= 0) != (expected >= 0)).sum() <= BOUNDARY_PIXELS


@pytest.mark.parametrize(("q", "t"), POSES)
def test_speedplus_lens(blender, make_scene, needles, q, t) -> None:
    assert_sees_what_embree_sees(blender, make_scene(*needles, q=q, t=t))


@pytest.mark.parametrize("k", [(0, 0, 0, 0, 0), (-0.1, 0.02, 0.003, -0.002, 0)])
@pytest.mark.parametrize(("fx", "fy"), [(250, 210), (210, 250)])
def test_off_centre_camera_with_oblong_pixels(blender, make_scene, needles, fx, fy, k) -> None:
    camera = Camera(width=192, height=120, fx=fx, fy=fy, cx=81.3, cy=70.9, distortion=k)
    assert_sees_what_embree_sees(blender, make_scene(*needles, camera=camera, q=(0.5, -0.3, 0.7, 0.2), t=(0, 0, 3)))


@pytest.mark.parametrize("range_m", [4.0, 1e3, 1e5, 1e7])
def test_range_costs_no_precision(blender, make_scene, needles, range_m) -> None:
    focal = 300 * range_m / 4
    camera = Camera(width=192, height=120, fx=focal, fy=focal, cx=96.0, cy=60.0)
    t = (0.1, -0.2, range_m)
    assert_sees_what_embree_sees(blender, make_scene(*needles, camera=camera, q=(0.5, -0.3, 0.7, 0.2), t=t))


def test_far_target_through_a_distorted_lens(blender, make_scene, needles, speedplus) -> None:
    camera = replace(speedplus, fx=6000.0, fy=6000.0, distortion=(-50.0, 0.0, 0.3, -0.2, 0.0))
    assert_sees_what_embree_sees(
        blender, make_scene(*needles, camera=camera, q=(0.5, -0.3, 0.7, 0.2), t=(0.9, 0.3, 80))
    )


@pytest.mark.parametrize("t", [(0, 0, 0.0), (-0.75, -0.1, 0.3), (0, 0.1, 0.7)])
def test_camera_inside_the_bounding_box(blender, make_scene, needles, speedplus, t) -> None:
    """In the tube, beyond the ball, before the tube: what is behind the camera is not seen."""
    camera = replace(speedplus, fx=80.0, fy=80.0, distortion=(0.0,) * 5)
    scene = make_scene(*needles, camera=camera, t=t)
    assert scene.region == camera.frame
    assert_sees_what_embree_sees(blender, scene)
    assert_sees_what_embree_sees(blender, replace(scene, camera=replace(camera, distortion=(-0.02, 0, 0, 0, 0))))


def test_a_speck_millimetres_before_the_camera_is_seen(blender, make_scene, needles, square, speedplus) -> None:
    points, faces = 0.05 * needles[0] + np.array([0, 0, 0.1]), needles[1]
    speck = 1.5e-3 * square[0] + np.array([0, 0, 0.015])
    both = np.concatenate([points, speck]), np.concatenate([faces, square[1] + len(points)])
    scene = make_scene(*both, t=(0, 0, 0))
    assert_sees_what_embree_sees(blender, scene)
    assert (blender.visibility(scene).face >= len(faces)).sum() > 500
    assert_sees_what_embree_sees(blender, replace(scene, camera=replace(speedplus, distortion=(0.0,) * 5)))


def squares_at(camera, pixels, half_px):
    """A square around the exact ray of each of the pixels' centres (N, 2): (points, faces), in camera axes at z = 1."""
    outline = half_px * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    uv = (pixels[:, None] + outline).reshape(-1, 2)
    first = 4 * np.arange(len(pixels))[:, None, None]
    points = np.concatenate([camera.normalised(uv), np.ones((len(uv), 1))], 1)
    return points, (first + np.array([(0, 1, 2), (0, 2, 3)])).reshape(-1, 3)


@pytest.mark.parametrize("corner", [-1, 1])
@pytest.mark.parametrize(
    ("focal", "distortion", "off_px"), [*((focal, 0.0, PLAIN_PX) for focal in PLAIN_FOCAL), (1.0, 1e-6, SHADER_PX)]
)
def test_labels_are_of_the_rays_through_pixel_centres(blender, make_scene, corner, focal, distortion, off_px) -> None:
    """In opposite corners of a large frame, where float32 is coarsest. A triangle beyond the frame makes the target as
    large as plain cameras need."""
    width, height = 1920, 1200
    camera = Camera(width=width, height=height, fx=focal * width, fy=focal * width, cx=width / 2, cy=height / 2,
                    distortion=(distortion, 0, 0, 0, 0))  # fmt: skip
    middle = np.array([width, height]) / 2
    inward = np.stack(np.meshgrid(np.arange(8), np.arange(8)), -1).reshape(-1, 2) + 0.5
    pixels = middle + corner * (middle - inward)
    points, faces = squares_at(camera, pixels, off_px)
    beyond = points[0] + 0.2 * np.linalg.norm(points[0]) * np.array([corner, 0, 0]) + 1e-3 * np.eye(3)
    both = np.concatenate([points, beyond]), np.concatenate([faces, [len(points) + np.arange(3)]])
    scene = make_scene(*both, camera=camera, t=(0, 0, 0))
    assert View.sharp(scene).plain == (distortion == 0)
    seen = blender.visibility(scene)
    column, row = (pixels - (seen.region.x0, seen.region.y0)).astype(int).T
    np.testing.assert_array_equal(seen.face[row, column] // 2, np.arange(len(pixels)))


def test_region_is_cut_from_the_same_picture(blender, make_scene, needles) -> None:
    camera = Camera(width=199, height=117, fx=250.0, fy=250.0, cx=99.5, cy=58.5)
    scene = make_scene(*needles, camera=camera, q=(0.5, -0.3, 0.7, 0.2))
    vars(scene)["region"] = camera.frame
    whole = blender.visibility(scene).face
    rng = np.random.default_rng(3)
    for _ in range(60):  # a border that is rounded wrongly is off by a pixel only now and then
        x0, y0 = int(rng.integers(0, 199)), int(rng.integers(0, 117))
        box = Region(x0=x0, y0=y0, x1=int(rng.integers(x0, 199)) + 1, y1=int(rng.integers(y0, 117)) + 1)
        vars(scene)["region"] = box
        assert np.array_equal(blender.visibility(scene).face, whole[box.slices])


def test_target_out_of_view_gives_empty_arrays(blender, make_scene, needles) -> None:
    scene = make_scene(*needles, t=(50, 0, 4))
    assert blender.visibility(scene).face.shape == (0, 0)
    assert blender.radiance(scene, Effort(samples=1), seed=0).rgb.shape == (0, 0, 3)


def test_frames_do_not_depend_on_their_order(blender, make_scene, needles, square) -> None:
    a, b = make_scene(*needles), make_scene(*square, q=(1, 0.2, 0, 0))
    far = with_first(a, T_cam_body=Transform(to="cam", of="body", rotation=np.eye(3), translation=[0, 0, 90]))
    first = blender.visibility(a).face
    blender.visibility(b)
    blender.visibility(far)
    assert np.array_equal(blender.visibility(a).face, first)


def test_duplicate_and_reversed_faces_keep_their_numbers(blender, make_scene, square) -> None:
    points, faces = square
    scene = make_scene(points, np.concatenate([faces, faces[:, ::-1], faces]))
    seen = blender.visibility(scene).face
    assert seen.max() < 6
    assert (seen >= 0).any()


@pytest.mark.slow
def test_memory_does_not_grow(blender, make_scene, needles) -> None:
    camera = Camera(width=64, height=40, fx=100.0, fy=100.0, cx=32.0, cy=20.0, distortion=(-0.1, 0, 0, 0, 0))
    scenes = [make_scene(*needles, camera=camera, t=(0, 0, z)) for z in (4, 40, 5, 50)]  # near and far, four meshes
    rss = psutil.Process().memory_info
    for i in range(240):
        if i == 40:
            before = rss().rss
        blender.visibility(scenes[i % 4])
    assert rss().rss - before < MEMORY_GROWTH


@pytest.mark.parametrize("numbers", [[1.5], [-1.0], [4.0], [np.nan], [np.inf]])
def test_a_picture_of_no_face_numbers_is_refused(numbers) -> None:
    with pytest.raises(RenderError, match="of no face"):
        face_indices(np.array([numbers], np.float32), 3)
