"""Light groups: their sum is the picture, and a render in unit light times its gains is the render as it is."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.light_groups import LightGroups, in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.environment import Environment, Planet
from spin_usd.scene.light import CylinderLight, DistantLight, DomeLight, RectLight, SphereLight
from spin_usd.scene.material import Material
from spin_usd.scene.scene import ThinLens
from spin_usd.scene.sensor import LUMINANCE
from spin_usd.scene.texture import Image
from tests.cases import scenes
from tests.cases.scenes import in_motion

WEIGHTS = np.array(LUMINANCE)  # rays are shared out by luminance: a colour of little weight may be noisier
ROUNDING = 2.0**-24  # of float32, at each sample that is added: Higham, "Accuracy and stability", section 4.2
EXACT = 1e-6
SEEDS = 12
SAMPLES = 16
SIGMAS = 4.0  # of the difference of two means of SEEDS renders
NOISIER = 1.15  # than with the lights' own strengths: rays are shared out by classes of CLASS only
MATT = Material(path="/matt", diffuse_color=(1, 1, 1), use_specular_workflow=True)
METAL = Material(path="/metal", diffuse_color=(0.6, 0.5, 0.4), metallic=0.7, roughness=0.35)
GLOWING = Material(path="/glowing", diffuse_color=(0.5, 0.5, 0.5), emissive_color=(3.0, 2.0, 1.0))
LIT = Material(path="/lit", diffuse_color=(0.3, 0.3, 0.5))
CAMERA = replace(scenes.SMALL, fx=90.0, fy=90.0, cx=32.0, cy=24.0, distortion=(0.0,) * 5)
AT = np.array([0, 0, 4.0])


def axes(name, t=(0.0, 0, 0), rotation=None):
    return Transform(to="cam", of=name, rotation=np.eye(3) if rotation is None else rotation, translation=np.array(t))


def sun(irradiance=(1361.0,) * 3, **fields):
    direction = np.array([0.3, 0.2, 1]) / np.linalg.norm([0.3, 0.2, 1])
    return DistantLight(path="/Sun", direction_cam=tuple(direction), irradiance=irradiance, angle=0.0093, **fields)


def panel(place, emission, **fields):
    """A square of 1 m that faces the target."""
    z = (place - AT) / np.linalg.norm(place - AT)
    x = np.cross([0.3, 1, 0.2], z) / np.linalg.norm(np.cross([0.3, 1, 0.2], z))
    there = axes("light", place, np.stack([x, np.cross(z, x), z], -1))
    return RectLight(path="/Panel", width=1.0, height=1.0, T_cam_light=there, emission=emission, **fields)


def ball(emission):
    there = axes("light", (-1.5, -1.0, 2.5))
    return SphereLight(path="/Ball", radius=0.2, T_cam_light=there, emission=emission)


def tube(emission):
    there = axes("light", (0.0, -1.5, 3.0))
    return CylinderLight(path="/Tube", length=1.0, radius=0.1, T_cam_light=there, emission=emission)


def dome(radiance, image=None):
    return DomeLight(path="/Dome", T_cam_dome=axes("dome"), radiance=radiance, image=image)


def starry():
    pixels = np.ones((32, 64, 4), np.float32)
    pixels[..., :3] = 5 * np.random.default_rng(3).random((32, 64, 1)) ** 4
    return Image(name="starry", pixels=pixels)


PLANET = Planet(path="/Planet", T_cam_planet=axes("planet", (0, 7e6, 1e6)), radii=(6.4e6,) * 3, albedo=(0.3, 0.3, 0.4))
RIGHT, LEFT = (panel(np.array(p), e) for p, e in [((2, 0, 2), (800.0, 700, 600)), ((-2, 0.5, 2), (100.0, 200, 300))])


@pytest.fixture(scope="module")
def taken(make_scene):
    """A matt box, a metal box and a third plate, which may glow, in other face groups."""
    boxes = scenes.box((-0.6, -0.4, -0.5), (0.2, 0.4, 0.5)), scenes.box((0.4, -0.1, -0.4), (0.9, 0.4, 0.1))
    (a, b), plate = boxes, scenes.box((-0.95, -0.5, -0.5), (-0.9, 0.5, 0.5))
    points = np.concatenate([a[0], b[0], plate[0]])
    faces = np.concatenate([a[1], b[1] + 8, plate[1] + 16])
    piece = np.repeat([0, 1, 2], 12)

    def make(*lights, planets=(), glowing=False, camera=CAMERA, **fields):
        materials = (MATT, METAL, GLOWING if glowing else LIT)
        fixed = {"face_material": piece, "face_group": piece.astype(np.uint16), "camera": camera}
        made = make_scene(points, faces, q=(0.8, 0.3, 0.4, 0.2), t=AT, materials=materials, lights=lights, **fixed)
        return replace(made, environment=Environment(planets=tuple(planets)), **fields)

    return make


SOURCES = {
    "Sun": ((sun(),), {}),
    "Sun, panels and dome": ((sun(), RIGHT, LEFT, dome((20.0, 20.0, 25.0), starry())), {}),
    "Sun and planet": ((sun(),), {"planets": [PLANET]}),
    "Sun and glow": ((sun((20.0,) * 3),), {"glowing": True}),
    "colours": ((sun((900.0, 500.0, 200.0)), ball((300.0, 2000.0, 3000.0)), dome((5.0, 50.0, 1.0))), {}),
    "no green": ((sun((900.0, 0.0, 200.0)), ball((0.0, 0.0, 3000.0))), {"planets": [PLANET]}),
    "eclipse": ((sun(obscuration=0.97), panel(np.array([2, 0, 2]), (20.0,) * 3)), {"planets": [PLANET]}),
    "total eclipse": ((sun(obscuration=1.0), tube((30.0,) * 3)), {}),
    "a lamp that is off": ((sun(), replace(RIGHT, emission=(0.0, 0.0, 0.0)), LEFT), {}),
    "a faint lamp": ((sun(), panel(np.array([2, 0, 2]), (6.0,) * 3)), {}),
    "everything": ((sun(), RIGHT, tube((50.0,) * 3), dome((9.0,) * 3)), {"planets": [PLANET], "glowing": True}),
    "glow": ((), {"glowing": True}),
    "nothing": ((), {}),
}
EACH = pytest.mark.parametrize("name", SOURCES)
FEW = ("Sun", "Sun, panels and dome", "no green", "everything")  # where many renders of each are compared


def as_one(blender, monkeypatch, scene, effort, **options):
    """The picture without groups."""
    with monkeypatch.context() as patch:
        patch.setattr("spin_usd.renderers.blender.renderer.group_names", lambda groups: ["all"])
        patch.setattr("spin_usd.renderers.blender.renderer.pass_name", lambda name: "Combined")
        return blender.radiance(scene, effort, **options)


def assert_sum(apart, whole, *, samples) -> None:
    np.testing.assert_array_equal(apart.coverage, whole.coverage)
    np.testing.assert_allclose(apart.rgb, whole.rgb, rtol=2 * samples * ROUNDING)


@EACH
def test_the_sum_of_the_groups_is_the_picture(blender, taken, monkeypatch, name) -> None:
    lights, fields = SOURCES[name]
    scene = taken(*lights, **fields)
    apart = blender.radiance(scene, Effort(samples=SAMPLES), seed=1)
    assert len(apart.groups) == LightGroups.of(scene).count
    assert all(group.any() for group in apart.groups)
    assert_sum(apart, as_one(blender, monkeypatch, scene, Effort(samples=SAMPLES), seed=1), samples=SAMPLES)


@pytest.mark.slow
def test_the_sum_is_the_picture_with_motion_and_depth_of_field_and_in_bands(blender, taken, monkeypatch) -> None:
    from spin_usd.renderers.crop import picture_bands

    lights, fields = SOURCES["everything"]
    scene = taken(*lights, **fields, camera=replace(CAMERA, width=128, height=96, fx=180.0, fy=180.0, cx=64, cy=48))
    start = scene.T_cam_body
    poses = tuple(
        replace(start, translation=start.translation + np.array([0.05 * share, 0, 0])) for share in (-1, 0, 1)
    )
    blurred = replace(in_motion(scene, poses), thin_lens=ThinLens(radius=0.01, focus=3.5))
    for case in (scene, blurred):
        assert len(picture_bands(case, samples=64)) > 1
        apart = blender.radiance(case, Effort(samples=64), seed=1)
        assert_sum(apart, as_one(blender, monkeypatch, case, Effort(samples=64), seed=1), samples=64)


@pytest.mark.slow
def test_each_group_is_what_its_source_makes_alone(blender, taken) -> None:
    """The order is that of LightGroups: lights by their places, then what shines from around, then what glows."""
    lights, fields = SOURCES["everything"]
    groups = blender.radiance(taken(*lights, **fields), Effort(samples=256), seed=1).groups.mean((1, 2))
    domeless = [taken(light) for light in lights[:3]]
    around = taken(lights[0], lights[3], planets=[PLANET])
    alone = [blender.radiance(scene, Effort(samples=256), seed=2).rgb.mean((0, 1)) for scene in domeless]
    alone.append(blender.radiance(around, Effort(samples=256), seed=2).groups[1].mean((0, 1)))
    alone.append(blender.radiance(taken(glowing=True), Effort(samples=256), seed=2).rgb.mean((0, 1)))
    np.testing.assert_allclose(groups, alone, rtol=0.05)  # what surfaces that do not glow here reflect is alike


def test_scenes_of_other_groups_do_not_disturb_one_another(blender, taken) -> None:
    """In any order, with labels between them, each is rendered as at first; nothing that Blender keeps is left over."""
    made = [taken(*lights, **fields) for lights, fields in SOURCES.values()]
    first = [blender.radiance(scene, Effort(samples=4), seed=2) for scene in made]
    faces = blender.visibility(made[0]).face
    for index in np.random.default_rng(0).integers(0, len(made), 3 * len(made)):
        again = blender.radiance(made[index], Effort(samples=4), seed=2)
        np.testing.assert_array_equal(again.groups, first[index].groups)
        np.testing.assert_array_equal(again.coverage, first[index].coverage)
        if index % 3 == 0:
            np.testing.assert_array_equal(blender.visibility(made[index]).face, faces)


@pytest.mark.parametrize("renderer", ["blender", "raycast"])
def test_a_light_that_reaches_nothing_has_a_plane_of_its_own(request, taken, renderer) -> None:
    drawer = RaycastRenderer() if renderer == "raycast" else request.getfixturevalue("blender")
    scene = taken(sun(), replace(RIGHT, lights=frozenset()), LEFT)
    dark = drawer.radiance(scene, Effort(samples=4), seed=1).groups
    assert [bool(group.any()) for group in dark] == [True, False, True]


@EACH
def test_the_preview_relit_is_the_preview(taken, name) -> None:
    lights, fields = SOURCES[name]
    scene, raycast = taken(*lights, **fields), RaycastRenderer()
    unit = in_unit_light(scene)
    relit = raycast.radiance(unit.scene, Effort(samples=2), seed=1).relit(unit.gains)
    direct = raycast.radiance(scene, Effort(samples=2), seed=1)
    np.testing.assert_array_equal(relit.coverage, direct.coverage)
    np.testing.assert_allclose(relit.rgb, direct.rgb, rtol=EXACT, atol=EXACT * direct.rgb.max())


@pytest.mark.parametrize("lights", [(sun((1361.0, 1000.0, 0.0)),), (ball((3.0, 2.0, 1.0)),), (dome((0.1, 7.0, 3.0)),)])
def test_one_light_relit_is_that_light(blender, taken, lights) -> None:
    scene = taken(*lights)
    unit = in_unit_light(scene)
    relit = blender.radiance(unit.scene, Effort(samples=SAMPLES), seed=1).relit(unit.gains)
    direct = blender.radiance(scene, Effort(samples=SAMPLES), seed=1)
    np.testing.assert_allclose(relit.rgb, direct.rgb, rtol=EXACT, atol=EXACT * direct.rgb.max())


@pytest.mark.parametrize(
    "name", [name if name in FEW else pytest.param(name, marks=pytest.mark.slow) for name in SOURCES]
)
def test_relit_renders_are_unbiased_and_no_noisier(blender, taken, name) -> None:
    lights, fields = SOURCES[name]
    scene = taken(*lights, **fields)
    unit = in_unit_light(scene)
    direct = [blender.radiance(scene, Effort(samples=SAMPLES), seed=seed).rgb for seed in range(SEEDS)]
    relit = [
        blender.radiance(unit.scene, Effort(samples=SAMPLES), seed=seed).relit(unit.gains).rgb
        for seed in range(SEEDS, 2 * SEEDS)
    ]
    means = [np.mean(pictures, (1, 2), np.float64) for pictures in (direct, relit)]
    error = np.sqrt(sum(mean.var(0, ddof=1) / SEEDS for mean in means))
    assert (np.abs(means[1].mean(0) - means[0].mean(0)) <= SIGMAS * error).all()
    noise, was = (np.sqrt(np.var(pictures @ WEIGHTS, 0, ddof=1).mean()) for pictures in (relit, direct))
    assert noise <= NOISIER * was
