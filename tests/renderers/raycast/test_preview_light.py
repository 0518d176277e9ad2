"""The preview's lights: against formulas of irradiance, far from the source and, where they are exact, near."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.renderers.raycast.renderer import RaycastRenderer, mean_radiance
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import (
    CylinderLight,
    DiskLight,
    DistantLight,
    DomeLight,
    PointLight,
    RectLight,
    Shaping,
    SphereLight,
)
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Image, Texture
from tests.cases.scenes import SMALL, scene, target

EXACT = 1e-6  # relative: float32 of the result
RANGE = 3.0  # metres from the light to the middle of the plate
POINTS, FACES = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]]), np.array([[0, 2, 1], [0, 3, 2]])
WHITE = Material(path="/white", diffuse_color=(1, 1, 1))
CENTRED = replace(SMALL, width=65, height=49, cx=32.5, cy=24.5)
RENDERER = RaycastRenderer()


def middle(lights, material=WHITE, **fields):
    s = scene(target(POINTS, FACES, materials=(material,), **fields), camera=CENTRED, lights=lights)
    picture = RENDERER.radiance(s, Effort(samples=1), seed=0)
    rows, columns = picture.region.shape
    return picture.rgb[rows // 2, columns // 2].astype(float)


def light(kind, lengths, *, tilt=0.0, offset=(0.0, 0.0), **fields):
    """RANGE before the plate's middle, shining at it (its -z is the camera's z), turned by `tilt` about y."""
    c, s = np.cos(tilt), np.sin(tilt)
    facing = np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1.0]]) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    place = Transform(to="cam", of="light", rotation=facing, translation=[*offset, 4 - RANGE])
    own = dict(zip(kind.lengths, lengths, strict=True))
    return kind(path="/l", T_cam_light=place, emission=(7.0, 5.0, 3.0), **own, **fields)


AREAS = {
    SphereLight: ((0.2,), lambda tilt: np.pi * 0.2**2),
    DiskLight: ((0.2, 0.3), lambda tilt: np.pi * 0.2 * 0.3 * np.cos(tilt)),
    RectLight: ((0.3, 0.5), lambda tilt: 0.3 * 0.5 * np.cos(tilt)),
    CylinderLight: ((0.4, 0.1), lambda tilt: 2 * 0.1 * 0.4 * np.cos(tilt)),
    PointLight: ((), lambda tilt: 1.0),
}


@pytest.mark.parametrize("kind", AREAS)
@pytest.mark.parametrize("tilt", [0.0, 1.0])
def test_an_area_light_is_its_shown_area_from_afar(kind, tilt) -> None:
    lengths, area = AREAS[kind]
    wanted = np.array([7, 5, 3]) * area(tilt) / RANGE**2 / np.pi
    assert middle([light(kind, lengths, tilt=tilt)]) == pytest.approx(wanted, rel=EXACT)


def test_disks_and_rectangles_shine_to_one_side() -> None:
    for kind in (DiskLight, RectLight):
        assert not middle([light(kind, AREAS[kind][0], tilt=np.pi)]).any()


def test_no_source_gives_more_than_it_has() -> None:
    """Against a plane that faces it, pi times its radiance."""
    assert middle([light(DiskLight, (1e3, 1e3))]) == pytest.approx([7, 5, 3], rel=EXACT)


def test_cones_focus_and_pictures_shape_the_light() -> None:
    plain = middle([light(DiskLight, (0.1, 0.1), tilt=0.5)])
    for shaping, factor in (
        (Shaping(cone_angle=0.51), 1),
        (Shaping(cone_angle=0.49), 0),
        (Shaping(cone_angle=1.0, softness=1.0), 0.5),
        (Shaping(cone_angle=np.pi, focus=3.0), np.cos(0.5) ** 3),
    ):
        found = middle([light(DiskLight, (0.1, 0.1), tilt=0.5, shaping=shaping)])
        assert found == pytest.approx(plain * factor, rel=EXACT)
    picture = Image(name="p", pixels=np.broadcast_to(np.float32([0.5, 0.25, 1, 1]), (2, 3, 4)))
    assert middle([light(RectLight, (0.1, 0.1), image=picture)]) == pytest.approx(
        middle([light(RectLight, (0.1, 0.1))]) * [0.5, 0.25, 1], rel=EXACT
    )


def test_a_dome_lights_from_all_around() -> None:
    """Radiance L from everywhere shows L on white, whatever stands around; an image counts by solid angle."""
    place = Transform(to="cam", of="dome", rotation=np.eye(3), translation=[0, 0, 0])
    dome = DomeLight(path="/d", T_cam_dome=place, radiance=(2.0, 4.0, 6.0))
    assert middle([dome]) == pytest.approx([2, 4, 6], rel=EXACT)
    rows = np.linspace(0, np.pi, 200, endpoint=False) + np.pi / 400
    pixels = np.broadcast_to(np.cos(rows)[:, None, None] ** 2, (200, 8, 4)).astype(np.float32)
    lit = replace(dome, image=Image(name="sky", pixels=pixels))
    assert mean_radiance(lit) == pytest.approx(np.array([2, 4, 6]) / 3, rel=1e-4)  # the mean of z^2 over a sphere


def test_shadows_end_at_the_light() -> None:
    """A plate beyond the light shades nothing; one between does, unless the light casts none or links it not."""
    for z, shaded in ((-3.5, False), (-1.5, True)):
        points = np.concatenate([POINTS, 0.05 * POINTS + (0.3, 0, z)])
        both = target(
            points, np.concatenate([FACES, FACES + 4]), materials=(WHITE,), face_group=np.array([0, 0, 1, 1], np.uint16)
        )
        lamp = light(SphereLight, (0.01,), offset=(0.6, 0.0))
        for given, is_shaded in (
            (lamp, shaded),
            (replace(lamp, shadows=False), False),
            (replace(lamp, shadowed_by=frozenset({0})), False),
            (replace(lamp, shadowed_by=frozenset({1})), shaded),
        ):
            picture = RENDERER.radiance(scene(both, camera=CENTRED, lights=[given]), Effort(samples=1), seed=0)
            rows, columns = picture.region.shape
            assert (picture.rgb[rows // 2, columns // 2, 0] == 0) == is_shaded


def test_linked_lights_reach_their_groups_only() -> None:
    sun = DistantLight(path="/s", direction_cam=(0.0, 0.0, 1.0), irradiance=(1.0, 1.0, 1.0), lights=frozenset({1}))
    for group, lit in ((0, False), (1, True)):
        assert middle([sun], face_group=np.full(2, group)).any() == lit


def test_an_eclipse_dims_the_sun() -> None:
    sun = DistantLight(path="/s", direction_cam=(0.0, 0.0, 1.0), irradiance=(np.pi,) * 3)
    whole = middle([sun])
    assert middle([replace(sun, obscuration=0.25)]) == pytest.approx(0.75 * whole)
    assert whole.any()
    assert not middle([replace(sun, obscuration=1.0)]).any()


def test_the_preview_shows_textures() -> None:
    image = Image(name="i", pixels=np.random.default_rng(0).random((4, 4, 4), np.float32))
    st = ((POINTS[:, :2] + 1) / 2)[FACES]
    colour = Texture(path="/t", image=image)
    sun = DistantLight(path="/s", direction_cam=(0.0, 0.0, 1.0), irradiance=(np.pi,) * 3)
    wanted = image.pixels[1:3, 1:3, :3].mean((0, 1))  # the middle of four texels
    glow = replace(WHITE, diffuse_color=(0, 0, 0), emissive_color=colour)
    specular = replace(WHITE, diffuse_color=(0, 0, 0), specular_color=colour, use_specular_workflow=True)
    for material, lights in ((replace(WHITE, diffuse_color=colour), [sun]), (specular, [sun]), (glow, [])):
        assert middle(lights, material, primvars={"st": st}) == pytest.approx(wanted, rel=1e-5)
