"""Holes in the labels and in shadows: Embree and Cycles see through them alike, and through nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Image, Primvar, Texture
from tests.cases.scenes import with_first

CHECKS = 8  # fields of the chequer per side
RIM = 0.02  # of a field: how near its border bilinear look-up and float32 may take either side
SEAM_PIXELS = 3  # pixels of a picture whose ray passes the seam of two triangles too near to call
CAMERA = Camera(width=96, height=96, fx=170, fy=170, cx=47.3, cy=48.6, distortion=(1e-3, 0, 0, 0, 0))
FIELDS = np.indices((CHECKS, CHECKS)).sum(0) % 2
CHEQUER = Image(name="chequer", pixels=np.repeat(FIELDS[..., None], 4, -1).astype(np.float32))
HOLED = Material(
    path="/holed",
    diffuse_color=(1, 1, 1),
    opacity=Texture(path="/t", image=CHEQUER, output="a"),
    opacity_threshold=0.5,
)
WHOLE = Material(path="/whole", diffuse_color=(1, 1, 1))
SUN = DistantLight(path="/Sun", direction_cam=(0.0, 0.0, 1.0), irradiance=(np.pi,) * 3)


def layers(make_scene, square, count, *, apart=0.1, **fields):
    """`count` chequered squares, each a little aside of the one before, in front of a whole one."""
    points, faces = square
    moved = [points + np.array([0.037, 0.021, apart]) * i for i in range(count)] + [2 * points + (0, 0, 1.5)]
    corners = np.tile((points[:, :2] + 1)[faces] / 2, (count + 1, 1, 1))
    return make_scene(
        np.concatenate(moved),
        np.concatenate([faces + 4 * i for i in range(count + 1)]),
        primvars={"st": corners},
        **{
            "camera": CAMERA,
            "materials": [HOLED, WHOLE],
            "face_material": np.repeat([0, 1], [2 * count, 2]),
            "q": (1, 0.07, 0.05, 0.02),
            **fields,
        },
    )


@pytest.mark.parametrize("count", [1, 2, 12])
def test_a_chequer_shows_what_lies_behind_it(blender, make_scene, square, count) -> None:
    """By both label passes, and by the chequer itself."""
    scene = layers(make_scene, square, count)
    cast, rendered = EmbreeCaster().visibility(scene), blender.visibility(scene)
    assert (cast.face != rendered.face).sum() <= SEAM_PIXELS
    assert {0, 1, 2 * count, 2 * count + 1} <= set(np.unique(cast.face))
    seen = visible_surface(scene, cast)
    front = seen.face < 2
    field = (seen.body[front, :2] + 1) / 2 * CHECKS
    inside = (np.abs(field - np.rint(field)) > RIM).all(1)
    column, row = np.floor(field[inside]).T.astype(int)
    assert inside.sum() > 1000
    assert (FIELDS[CHECKS - 1 - row, column] == 1).all()
    there = (cast.face < 2) & (cast.face >= 0)
    whole = blender.visibility(layers(make_scene, square, count, materials=[WHOLE, WHOLE])).face
    assert 0.4 < there.sum() / ((whole < 2) & (whole >= 0)).sum() < 0.6


def test_holes_in_layers_that_almost_touch(blender, make_scene, square) -> None:
    scene = layers(make_scene, square, 6, apart=2e-5)
    cast, rendered = EmbreeCaster().visibility(scene).face, blender.visibility(scene).face
    assert (cast != rendered).sum() <= SEAM_PIXELS


@pytest.mark.parametrize(("opacity", "there"), [(0.49, False), (0.5, True), (0.51, True)])
@pytest.mark.parametrize("as_primvar", [False, True])
def test_a_hole_is_below_the_threshold(blender, make_scene, square, opacity, there, as_primvar) -> None:
    value = Primvar(name="opacity") if as_primvar else opacity
    holed = replace(HOLED, opacity=value)
    scene = make_scene(*square, materials=[holed], primvars={"opacity": np.full((2, 3, 1), opacity)})
    for label_pass in (blender, EmbreeCaster()):
        assert (label_pass.visibility(scene).face >= 0).any() == there


def test_labels_and_pictures_take_turns(blender, make_scene, square) -> None:
    """Numbers and materials share the mesh's slots where there are holes."""
    scene = layers(make_scene, square, 2, lights=[SUN])
    face, rgb = blender.visibility(scene).face, blender.radiance(scene, Effort(samples=4), seed=0).rgb
    other = layers(make_scene, square, 2, materials=[WHOLE, WHOLE], lights=[SUN])
    whole = blender.visibility(other).face
    assert (whole != face).mean() > 0.2
    assert np.array_equal(blender.visibility(scene).face, face)
    assert np.array_equal(blender.radiance(scene, Effort(samples=4), seed=0).rgb, rgb)


def test_the_preview_lets_light_through_holes(make_scene, square) -> None:
    """The Sun behind the camera: what the camera sees through a hole is lit through it."""
    scene = layers(make_scene, square, 1, lights=[SUN], q=(1, 0, 0, 0), t=(0, 0, 3e5),
                   camera=replace(CAMERA, fx=170e5, fy=170e5))  # fmt: skip
    renderer = RaycastRenderer()
    seen = visible_surface(scene, EmbreeCaster().visibility(scene))
    rgb = renderer.radiance(scene, Effort(samples=1), seed=0).rgb[
        seen.rows - scene.region.y0, seen.columns - scene.region.x0
    ]
    behind = seen.face >= 2
    within = (np.abs(seen.body[:, :2]) < 1).all(1)
    assert (behind & within).sum() > 500
    assert (rgb[behind & within, 0] > 0).mean() > 0.99
    slanted = replace(scene, lights=(replace(SUN, direction_cam=(0.25 / 1.5, 0.0, np.sqrt(1 - (0.25 / 1.5) ** 2))),))
    rgb = renderer.radiance(slanted, Effort(samples=1), seed=0).rgb
    rgb = rgb[seen.rows - scene.region.y0, seen.columns - scene.region.x0]
    assert (rgb[behind & within, 0] > 0).mean() < 0.2  # a field further on, the chequer stands between


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_size_costs_no_holes(make_scene, square, size) -> None:
    one, other = (layers(make_scene, (k * square[0], square[1]), 1) for k in (1.0, 1.0))
    points = other.target.mesh.points * size
    mesh = replace(other.target.mesh, points=points)
    pose = replace(other.T_cam_body, translation=other.T_cam_body.translation * size)
    other = with_first(other, T_cam_body=pose, target=replace(other.target, mesh=mesh))
    caster = EmbreeCaster()
    assert (caster.visibility(one).face != caster.visibility(other).face).sum() <= SEAM_PIXELS
