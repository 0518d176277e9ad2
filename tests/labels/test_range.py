"""Range is the distance along each pixel's own ray, for both renderers; `check` finds what is not."""

import cv2
import numpy as np
import pytest
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from spin_usd.labels.range import faults
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.renderers.embree.caster import EmbreeCaster
from tests.cases.labelled import followed, labels_of, picture_of, sun
from tests.cases.scenes import BARREL, pose, scene, soup, target

FLOAT32 = 6e-8  # half a step of float32, relative
NEWTON = 2e-7  # OpenCV's own inverse of the lens, at its finest criterion
EDGE_ON = 1e-5  # relative, where a ray meets its triangle at a flat angle
ASIDE = pose((0.5, -0.3, 0.7, 0.2), (1.6, -0.9, 3))
FINEST = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-14)


@pytest.fixture(params=["embree", "blender"])
def labelled(request):
    """A scene, partly outside the frame, and its labels as the visible faces of a label pass make them."""
    label_pass = EmbreeCaster() if request.param == "embree" else request.getfixturevalue("blender")
    points, faces, parts = soup(11, count=60)
    made = scene(target(points, faces, parts=parts), camera=BARREL, T_cam_body=ASIDE, lights=[sun((0.6, 0.0, 0.8))])
    made = followed(made, pose((0.5, -0.35, 0.7, 0.25), (1.3, -0.7, 3.2)))
    labels = labels_of(made, label_pass)
    assert (labels["depth"] > 0).sum() > 5000
    return made, labels


def opencv_rays(camera, rows, columns):
    """Unit rays (N, 3) through the pixels' centres, by OpenCV's inverse of the lens."""
    uv = np.stack([columns + 0.5, rows + 0.5], -1)[:, None]
    xy = cv2.undistortPoints(uv, camera.matrix, np.array(camera.distortion), criteria=FINEST)[:, 0]
    rays = np.concatenate([xy, np.ones((len(xy), 1))], -1)
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def test_range_is_depth_over_the_cosine_to_the_axis(labelled) -> None:
    made, labels = labelled
    seen = np.nonzero(labels["depth"])
    cosine = opencv_rays(made.camera, *seen)[:, 2]
    assert cosine.min() < 0.9  # elsewhere range and depth could hardly be told apart
    np.testing.assert_allclose(labels["range"][seen] * cosine, labels["depth"][seen], rtol=2 * FLOAT32 + NEWTON)


def test_range_is_how_far_a_ray_travels(labelled) -> None:
    """A ray that Embree casts along OpenCV's direction, from the camera to the first triangle's plane."""
    made, labels = labelled
    rows, columns = np.nonzero(labels["range"])
    points, faces = made.T_cam_body.points(made.target.mesh.points), made.target.mesh.faces
    rays = opencv_rays(made.camera, rows, columns)
    mesh = trimesh.Trimesh(points, faces, process=False)
    where, ray, _ = RayMeshIntersector(mesh).intersects_location(np.zeros_like(rays), rays, multiple_hits=False)
    assert len(ray) > 0.999 * len(rays)  # a ray along an edge may pass on either side of it
    off = np.linalg.norm(where, axis=1) / labels["range"][rows[ray], columns[ray]] - 1
    assert np.quantile(np.abs(off), 0.999) < EDGE_ON


def test_every_label_agrees_with_the_others(labelled) -> None:
    made, labels = labelled
    assert [fault for label in PIXEL_LABELS.values() for fault in label.faults(picture_of(made, labels))] == []


@pytest.mark.parametrize("against", ["depth", "dense_pose"])
def test_a_range_that_is_off_is_found(labelled, against) -> None:
    made, labels = labelled
    others = {name: None for name in ("depth", "dense_pose") if name != against}
    off = labels["range"] * np.float32(1 + 5e-6)
    (fault,) = faults(picture_of(made, labels, range=off, **others))
    assert fault.code == "range"
    assert fault.message.startswith(f"range and {against.replace('_', ' ')} differ by 5.")


def test_a_range_that_is_planar_depth_is_found(labelled) -> None:
    made, labels = labelled
    assert {fault.code for fault in faults(picture_of(made, labels, range=labels["depth"]))} == {"range"}


def test_a_range_of_other_pixels_is_found(labelled) -> None:
    made, labels = labelled
    more = labels["range"] + np.float32(labels["range"] == 0)
    assert [fault.code for fault in faults(picture_of(made, labels, range=more, dense_pose=None))] == ["support"]
