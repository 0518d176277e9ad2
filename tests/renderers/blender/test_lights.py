"""Every light of UsdLux and every switch of its units: the radiance of a white Lambertian plane against the formulas.

From the text of a stage to Blender's pixels. Stage and camera share their axes: x right, y up, the camera at the origin
looking along -z. The point that is measured lies 4 m before the camera on a plane that faces it.
"""

from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.errors import UnsupportedError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.blender.textures import forget_render_data
from spin_usd.scene.effort import Effort
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Image
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.emission import EMISSIONS
from spin_usd.stage.read.lights import MAX_DISTANCE_M, MIN_SIZE_M, LightReader
from spin_usd.stage.usd.camera_space import CameraSpace
from tests.authorities import irradiance as by
from tests.cases.scenes import with_first

SAMPLES = 4096
RADIOMETRY = 0.005  # relative: what is promised of a light at SAMPLES
EDGE = 1e-3  # of it: half of the 4 mm that are measured see a sliver of a light whose plane goes through their middle
DARK = 1e-6  # of what the light would give from the front
P, N = np.array([0, 0, -4.0]), np.array([0, 0, 1.0])
L = 5.0
CAMERA = Camera(width=4, height=4, fx=4000, fy=4000, cx=2, cy=2)  # 4 mm of the plane
T_WORLD_USDCAM = Transform(to="world", of="usdcam", rotation=np.eye(3), translation=np.zeros(3))

AT = 'double3 xformOp:translate = {0}\nuniform token[] xformOpOrder = ["xformOp:translate"]'
TURNED = (
    "double3 xformOp:translate = {0}\nfloat3 xformOp:rotateXYZ = {1}\nfloat3 xformOp:scale = {2}\n"
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]'
)


def lux(kind, *attributes, at=(0, 0, -2), turn=None, scale=(1, 1, 1), api=(), metadata="metersPerUnit = 1") -> str:
    """The text of a stage with one light of intensity L at `at`, turned about x, y, z by `turn` degrees."""
    place = AT.format(at) if turn is None and scale == (1, 1, 1) else TURNED.format(at, turn or (0, 0, 0), scale)
    applied = f"(\nprepend apiSchemas = {list(api)}\n)".replace("'", '"') if api else ""
    lines = "\n".join([f"float inputs:intensity = {L}", *attributes, place])
    return f'#usda 1.0\n(\n{metadata}\nupAxis = "Y"\n)\ndef {kind} "Light" {applied}\n{{\n{lines}\n}}\n'


def read(text):
    """The lights of a stage's text."""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(text)
    time, metres = Usd.TimeCode.Default(), UsdGeom.GetStageMetersPerUnit(stage)
    space = CameraSpace(time=time, world=UsdGeom.XformCache(time), T_world_usdcam=T_WORLD_USDCAM, metres=metres)
    return LightReader(stage, Images()).read(space)


def turned(x, y=0.0, z=0.0):
    """The rotation of xformOp:rotateXYZ: about x first."""
    (a, b, c), cos, sin = np.radians([x, y, z]), np.cos, np.sin
    about_x = np.array([[1, 0, 0], [0, cos(a), -sin(a)], [0, sin(a), cos(a)]])
    about_y = np.array([[cos(b), 0, sin(b)], [0, 1, 0], [-sin(b), 0, cos(b)]])
    about_z = np.array([[cos(c), -sin(c), 0], [sin(c), cos(c), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def corners(width, height, R=None, at=(0, 0, -2)):
    flat = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * (width / 2, height / 2, 0)
    return flat @ (np.eye(3) if R is None else R).T + at


def integral(pieces, *, R=None, at=(0, 0, -2), factor=None):
    R = np.eye(3) if R is None else R
    points, normals, areas = by.moved(pieces, R, np.array(at))
    return by.surface(factor or (lambda d: np.ones(len(d))), points, normals, areas, P, N)


WARM = np.array(UsdLux.BlackbodyTemperatureAsRgb(3000))
SHAPED = ("ShapingAPI",)
SOFT = ("float inputs:shaping:cone:angle = 60", "float inputs:shaping:cone:softness = 0.7")
NORMALIZED = "bool inputs:normalize = 1"
TILT = turned(35, -20, 50)
DOWN = (0, 0, -1)  # along which lights shine that are not turned
OFF = (1.2, -0.7, -2.5)  # a place off the point's normal
LOW = (2.9, 0, -4 + 0.5)  # 80 degrees off the normal


def cm(value):
    return tuple(100 * v for v in value)


CASES = {
    "distant, normalised": (lux("DistantLight", NORMALIZED), L),
    "distant, normalised, angle 30": (lux("DistantLight", NORMALIZED, "float inputs:angle = 30"), L),
    "distant, angle 30": (lux("DistantLight", "float inputs:angle = 30"), np.pi * L * np.sin(np.radians(15)) ** 2),
    "distant, oblique": (lux("DistantLight", NORMALIZED, turn=(0, 60, 0)), L / 2),
    "distant, exposure 2": (lux("DistantLight", NORMALIZED, "float inputs:exposure = 2"), 4 * L),
    "sphere": (lux("SphereLight"), by.sphere(L, (0, 0, -2), 0.5, P, N)),
    "sphere, radius 1.5": (lux("SphereLight", "float inputs:radius = 1.5"), by.sphere(L, (0, 0, -2), 1.5, P, N)),
    "sphere, radius 0.001": (lux("SphereLight", "float inputs:radius = 1e-3"), by.sphere(L, (0, 0, -2), 1e-3, P, N)),
    "sphere, normalised": (lux("SphereLight", NORMALIZED), by.sphere(L / np.pi, (0, 0, -2), 0.5, P, N)),
    "sphere, normalised, radius 0": (
        lux("SphereLight", NORMALIZED, "float inputs:radius = 0"),
        by.point(L / 4, (0, 0, -2), P, N),
    ),
    "sphere, exposure -3": (lux("SphereLight", "float inputs:exposure = -3"), by.sphere(L / 8, (0, 0, -2), 0.5, P, N)),
    "sphere, colour": (
        lux("SphereLight", "color3f inputs:color = (1, 0.25, 0.5)"),
        by.sphere(L, (0, 0, -2), 0.5, P, N) * np.array([1, 0.25, 0.5]),
    ),
    "sphere, 3000 K": (
        lux("SphereLight", "bool inputs:enableColorTemperature = 1", "float inputs:colorTemperature = 3000"),
        by.sphere(L, (0, 0, -2), 0.5, P, N) * WARM,
    ),
    "sphere, off the normal": (lux("SphereLight", at=OFF), by.sphere(L, OFF, 0.5, P, N)),
    "sphere, grazing": (
        lux("SphereLight", "float inputs:radius = 0.2", at=LOW),
        by.sphere(L, LOW, 0.2, P, N),
    ),
    "sphere, half below the horizon": (
        lux("SphereLight", at=(2, 0, -4)),
        integral(by.sphere_pieces(0.5), at=(2, 0, -4)) * L,
    ),
    "sphere, scaled by 2": (lux("SphereLight", scale=(2, 2, 2)), by.sphere(L, (0, 0, -2), 1.0, P, N)),
    "sphere, normalised, scaled by 2": (
        lux("SphereLight", NORMALIZED, scale=(2, 2, 2)),
        by.sphere(L / (4 * np.pi), (0, 0, -2), 1.0, P, N),
    ),
    "sphere, centimetres": (
        lux("SphereLight", "float inputs:radius = 50", at=cm(OFF), metadata="metersPerUnit = 0.01"),
        by.sphere(L, OFF, 0.5, P, N),
    ),
    "sphere, far and large": (
        lux("SphereLight", "float inputs:radius = 6.957e8", at=(0, 0, 1.496e11)),
        by.sphere(L, (0, 0, 1.496e11), 6.957e8, P, N),
    ),
    "sphere as a point": (lux("SphereLight", "bool treatAsPoint = 1", at=OFF), by.point(L * np.pi / 4, OFF, P, N)),
    "sphere as a point, normalised": (
        lux("SphereLight", "bool treatAsPoint = 1", NORMALIZED, at=OFF),
        by.point(L / 4, OFF, P, N),
    ),
    "disk": (lux("DiskLight"), np.pi * L * 0.25 / (0.25 + 4)),
    "disk, radius 3": (lux("DiskLight", "float inputs:radius = 3"), np.pi * L * 9 / (9 + 4)),
    "disk, normalised": (lux("DiskLight", NORMALIZED), L / (0.25 + 4)),
    "disk, tilted": (
        lux("DiskLight", at=OFF, turn=(35, -20, 50)),
        L * integral(by.disk_pieces(0.5, 0.5), R=TILT, at=OFF),
    ),
    "disk, stretched": (
        lux("DiskLight", at=OFF, scale=(3, 1, 1)),
        L * integral(by.disk_pieces(1.5, 0.5), at=OFF),
    ),
    "disk, stretched, normalised": (
        lux("DiskLight", NORMALIZED, at=OFF, scale=(3, 1, 1)),
        L / (np.pi * 0.75) * integral(by.disk_pieces(1.5, 0.5), at=OFF),
    ),
    "disk, grazing": (
        lux("DiskLight", "float inputs:radius = 0.2", at=LOW, turn=(0, 80, 0)),
        L * integral(by.disk_pieces(0.2, 0.2), R=turned(0, 80, 0), at=LOW),
    ),
    "rectangle": (lux("RectLight"), by.polygon(L, corners(1, 1), P, N)),
    "rectangle, 6 by 0.5": (
        lux("RectLight", "float inputs:width = 6", "float inputs:height = 0.5"),
        by.polygon(L, corners(6, 0.5), P, N),
    ),
    "rectangle, normalised": (
        lux("RectLight", NORMALIZED, "float inputs:width = 3"),
        by.polygon(L / 3, corners(3, 1), P, N),
    ),
    "rectangle, tilted": (lux("RectLight", at=OFF, turn=(35, -20, 50)), by.polygon(L, corners(1, 1, TILT, OFF), P, N)),
    "rectangle, stretched, normalised": (
        lux("RectLight", NORMALIZED, at=OFF, turn=(35, -20, 50), scale=(2, 0.5, 7)),
        by.polygon(L, corners(2, 0.5, TILT, OFF), P, N),
    ),
    "rectangle, centimetres": (
        lux(
            "RectLight",
            "float inputs:width = 100",
            "float inputs:height = 100",
            at=cm(OFF),
            metadata="metersPerUnit = 0.01",
        ),
        by.polygon(L, corners(1, 1, at=OFF), P, N),
    ),
    "cylinder": (lux("CylinderLight", "float inputs:radius = 0.2"), L * integral(by.tube_pieces(1, 0.2))),
    "cylinder, long and thin": (
        lux("CylinderLight", "float inputs:radius = 0.01", "float inputs:length = 20"),
        L * integral(by.tube_pieces(20, 0.01, 1500)),
    ),
    "cylinder, normalised": (
        lux("CylinderLight", "float inputs:radius = 0.2", NORMALIZED),
        L / (2 * np.pi * 0.2) * integral(by.tube_pieces(1, 0.2)),
    ),
    "cylinder, tilted": (
        lux("CylinderLight", at=OFF, turn=(35, -20, 50)),
        L * integral(by.tube_pieces(1, 0.5), R=TILT, at=OFF),
    ),
    "cylinder, end on": (  # seen along its axis there is only its mantle's inside, which is dark
        lux("CylinderLight", turn=(0, 90, 0)),
        0.0,
    ),
    "cylinder, stretched, as a line": (
        lux("CylinderLight", "bool treatAsLine = 1", at=OFF, scale=(3, 0.5, 0.5)),
        L * integral(by.tube_pieces(3, 0.25), at=OFF),
    ),
    "point, soft cone": (
        lux("SphereLight", "bool treatAsPoint = 1", *SOFT, at=OFF, api=SHAPED),
        by.point(L * np.pi / 4, OFF, P, N) * by.shaping(DOWN, cone=60, softness=0.7)(by.unit(P - OFF)[None])[0],
    ),
    "point, hard cone, inside": (
        lux("SphereLight", "bool treatAsPoint = 1", "float inputs:shaping:cone:angle = 46", at=OFF, api=SHAPED),
        by.point(L * np.pi / 4, OFF, P, N),
    ),
    "point, focus": (
        lux("SphereLight", "bool treatAsPoint = 1", "float inputs:shaping:focus = 3", at=OFF, api=SHAPED),
        by.point(L * np.pi / 4, OFF, P, N) * by.shaping(DOWN, focus=3)(by.unit(P - OFF)[None])[0],
    ),
    "sphere, soft cone": (
        lux("SphereLight", *SOFT, at=OFF, api=SHAPED),
        L * integral(by.sphere_pieces(0.5), at=OFF, factor=by.shaping(DOWN, cone=60, softness=0.7)),
    ),
    "sphere, hard cone through it": (
        lux("SphereLight", "float inputs:shaping:cone:angle = 40", at=OFF, api=SHAPED),
        L * integral(by.sphere_pieces(0.5), at=OFF, factor=by.shaping(DOWN, cone=40)),
    ),
    "disk, focus 4": (
        lux("DiskLight", "float inputs:shaping:focus = 4", at=OFF, turn=(35, -20, 50), api=SHAPED),
        L * integral(by.disk_pieces(0.5, 0.5), R=TILT, at=OFF, factor=by.shaping(TILT @ DOWN, focus=4)),
    ),
    "rectangle, focus 2, tinted": (
        lux(
            "RectLight",
            "float inputs:shaping:focus = 2",
            "color3f inputs:shaping:focusTint = (1, 0.5, 0)",
            at=OFF,
            api=SHAPED,
        ),
        [
            L * integral(by.rect_pieces(1, 1), at=OFF, factor=lambda d, t=t: t + (1 - t) * by.shaping(DOWN, focus=2)(d))
            for t in (1.0, 0.5, 0.0)
        ],
    ),
    "rectangle, soft cone": (
        lux("RectLight", *SOFT, at=OFF, api=SHAPED),
        L * integral(by.rect_pieces(1, 1), at=OFF, factor=by.shaping(DOWN, cone=60, softness=0.7)),
    ),
    "cylinder, soft cone": (
        lux("CylinderLight", *SOFT, at=OFF, api=SHAPED),
        L * integral(by.tube_pieces(1, 0.5), at=OFF, factor=by.shaping(DOWN, cone=60, softness=0.7)),
    ),
}


@pytest.fixture
def plane(make_scene, square):
    """A function that makes the scene of a white plane and lights, and one that measures it."""
    return lambda lights: make_scene(*square, camera=CAMERA, lights=lights)


def measured(blender, scene, samples=SAMPLES):
    """Irradiance (3,) of the white plane's middle."""
    return np.pi * blender.radiance(scene, Effort(samples=samples), seed=1).rgb.astype(float).mean((0, 1))


@pytest.mark.parametrize("case", CASES)
def test_irradiance(blender, plane, case, record_property) -> None:
    text, expected = CASES[case]
    expected = np.broadcast_to(np.asarray(expected, float), 3)
    found = measured(blender, plane(read(text)))
    record_property("expected", expected.tolist())
    record_property("found", found.tolist())
    assert found == pytest.approx(expected, rel=RADIOMETRY, abs=DARK * L)


@pytest.mark.parametrize("kind", ["SphereLight", "DiskLight", "RectLight", "CylinderLight"])
def test_light_from_behind_the_plane_is_none(blender, plane, kind) -> None:
    assert not measured(blender, plane(read(lux(kind, at=(0.3, 0.2, -6), turn=(180, 0, 0)))), samples=16).any()


@pytest.mark.parametrize("kind", ["DiskLight", "RectLight"])
def test_flat_lights_shine_to_one_side_only(blender, plane, kind) -> None:
    assert not measured(blender, plane(read(lux(kind, turn=(180, 0, 0)))), samples=16).any()
    edge_on = measured(blender, plane(read(lux(kind, turn=(0, 90, 0)))), samples=16)
    assert edge_on.max() < EDGE * by.sphere(L, (0, 0, -2), 0.5, P, N)
    assert not measured(blender, plane(read(lux(kind, at=(2, 0, -4)))), samples=16).any()  # in the plane itself


@pytest.mark.parametrize("range_m", [4.0, 100.0, 4e5])
def test_the_range_does_not_change_the_light(blender, plane, range_m) -> None:
    """Near and far, where Blender's world has its origin at the target and rays start there."""
    scene, shift = plane(read(lux("SphereLight", at=OFF))), np.array([0, 0, range_m - 4])
    camera = replace(CAMERA, fx=1000 * range_m, fy=1000 * range_m)
    T_cam_body = replace(scene.T_cam_body, translation=scene.T_cam_body.translation + shift)
    light = scene.lights[0]
    light = replace(light, T_cam_light=replace(light.T_cam_light, translation=light.T_cam_light.translation + shift))
    found = measured(
        blender, with_first(replace(scene, camera=camera, lights=(light,)), T_cam_body=T_cam_body), samples=256
    )
    assert found == pytest.approx(by.sphere(L, OFF, 0.5, P, N), rel=RADIOMETRY)


def test_an_image_lies_upright_on_its_rectangle(blender, plane) -> None:
    """Seen from the lit side its top left corner is at +x, +y (UsdLux.RectLight): only that quarter shines, in red."""
    pixels = np.zeros((2, 2, 4), np.float32)
    pixels[0, 0] = 1, 0, 0, 1
    big = Image(name="quarter", pixels=pixels.repeat(32, 0).repeat(32, 1))
    (light,) = read(lux("RectLight", "float inputs:width = 3", "float inputs:height = 2", at=(0.4, 0.3, -2)))
    found = measured(blender, plane([replace(light, image=big)]))
    quarter = by.polygon(L, corners(1.5, 1, at=(0.4 + 0.75, 0.3 + 0.5, -2)), P, N)
    assert found == pytest.approx([quarter, 0, 0], rel=2 * RADIOMETRY, abs=DARK)  # its edges are half a texel soft


MIRROR = Material(path="/mirror", diffuse_color=(1, 1, 1), metallic=1.0, roughness=0.0)


@pytest.mark.parametrize("kind", ["SphereLight", "DiskLight", "RectLight", "CylinderLight"])
def test_reflections_show_what_the_camera_does_not(blender, make_scene, square, kind) -> None:
    """A lamp between the camera and a mirror: its own side is seen in the mirror, it is not in the way."""
    lights = read(lux(kind, at=(0, 0, -2)))
    seen = blender.radiance(
        make_scene(*square, camera=CAMERA, materials=[MIRROR], lights=lights), Effort(samples=64), seed=1
    )
    assert seen.rgb == pytest.approx(L, rel=RADIOMETRY)
    white = make_scene(*square, camera=CAMERA, lights=lights)
    assert measured(blender, white).max() < 0.5 * np.pi * L


def stripes(make_scene, **fields):
    """A plane and, a metre before it, a strip in front of its middle; face groups 0 and 1."""
    plane = np.array([[-9, -9, 0], [-9, 9, 0], [9, 9, 0], [9, -9, 0.0]])
    strip = np.array([[-0.4, -9, -1], [-0.4, 9, -1], [0.4, 9, -1], [0.4, -9, -1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    camera = Camera(width=16, height=4, fx=16, fy=16, cx=8, cy=2)
    every = {"camera": camera, "face_group": [0, 0, 1, 1]}
    return make_scene(np.concatenate([plane, strip]), np.concatenate([faces, faces + 4]), **{**every, **fields})


SHADED, OPEN, STRIP = slice(4, 5), slice(12, 16), slice(7, 9)  # columns, for light from the right

LAMPS = {
    "DistantLight": lux("DistantLight", NORMALIZED, "float inputs:angle = 0", turn=(0, 45, 0)),
    "SphereLight": lux("SphereLight", "float inputs:radius = 0.01", at=(3, 0, 0)),
    "RectLight": lux("RectLight", at=(3, 0, 0), turn=(0, 40, 0), scale=(0.02, 0.02, 0.02)),
    "CylinderLight": lux("CylinderLight", "float inputs:radius = 0.01", at=(3, 0, 0), turn=(0, 0, 90)),
}


@pytest.mark.parametrize("kind", LAMPS)
def test_shadows_and_links(blender, make_scene, kind) -> None:
    """Which stripes are lit, as lights reach one group or the other and are shadowed by one or the other or none. Each
    follows in the next render, whatever the one before was."""
    (light,) = read(LAMPS[kind])
    scene = stripes(make_scene, materials=[Material(path="/w", diffuse_color=(0.01,) * 3, use_specular_workflow=True)])

    def lit(**links):
        rgb = blender.radiance(replace(scene, lights=(replace(light, **links),)), Effort(samples=16), seed=1).rgb[
            0, :, 0
        ]
        free = rgb[OPEN].mean()
        return [bool(rgb[part].mean() > 0.3 * reference) for part in (SHADED, OPEN, STRIP)], free

    reference = 1e-9
    reference = lit()[1]
    assert reference > 0
    expected = {
        (): [False, True, True],
        (("shadows", False),): [True, True, True],
        (("shadowed_by", frozenset({0})),): [True, True, True],
        (("shadowed_by", frozenset({1})),): [False, True, True],
        (("shadowed_by", frozenset()),): [True, True, True],
        (("lights", frozenset({0})),): [False, True, False],
        (("lights", frozenset({1})),): [False, False, True],
        (("lights", frozenset({0})), ("shadows", False)): [True, True, False],
        (("lights", frozenset()),): [False, False, False],
        (("lights", frozenset({0, 1})),): [False, True, True],
    }
    for links, wanted in expected.items():
        assert (links, lit(**dict(links))[0]) == (links, wanted)


def test_frames_do_not_depend_on_the_lights_before(blender, make_scene) -> None:
    """Every picture's bytes are the same after any other and after none: lights of all kinds come, go, change and are
    linked."""
    base = stripes(make_scene)
    sets = [
        [],
        [LAMPS["DistantLight"]],
        [LAMPS["CylinderLight"], LAMPS["SphereLight"]],
        [LAMPS["SphereLight"]],
        [LAMPS["RectLight"], LAMPS["SphereLight"]],
        [LAMPS["SphereLight"], LAMPS["RectLight"]],
        [LAMPS["RectLight"], LAMPS["SphereLight"], LAMPS["DistantLight"], LAMPS["CylinderLight"]],
        [LAMPS["DistantLight"], LAMPS["SphereLight"], LAMPS["RectLight"]],
        [lux("RectLight", *SOFT, at=OFF, api=SHAPED), LAMPS["CylinderLight"]],
        [lux("RectLight", at=OFF), LAMPS["CylinderLight"]],
        [lux("RectLight", NORMALIZED, at=OFF, scale=(2, 1, 1)), LAMPS["CylinderLight"]],
    ]
    scenes = [replace(base, lights=tuple(light for text in texts for light in read(text))) for texts in sets]
    last = replace(scenes[-1].lights[1], lights=frozenset({0}))
    scenes.append(replace(base, lights=(scenes[-1].lights[0], last)))
    first = [blender.radiance(scene, Effort(samples=3), seed=5).rgb.tobytes() for scene in scenes]
    assert len(set(first)) == len(first)
    for turn, i in enumerate(np.random.default_rng(3).permutation(np.repeat(np.arange(len(scenes)), 3))):
        if turn % 4 == 0:
            forget_render_data()  # as a renderer just opened
        assert blender.radiance(scenes[i], Effort(samples=3), seed=5).rgb.tobytes() == first[i]


def test_many_lamps_add_up(blender, plane) -> None:
    """Chosen among by the light tree, and each alone."""
    texts = [LAMPS[kind] for kind in ("SphereLight", "RectLight", "CylinderLight")]
    texts += [lux("DiskLight", at=OFF), lux("SphereLight", at=(-1, 0.5, -3)), lux("DistantLight", NORMALIZED)]
    lights = [light for text in texts for light in read(text)]
    alone = sum(measured(blender, plane([light])) for light in lights)
    assert measured(blender, plane(lights)) == pytest.approx(alone, rel=RADIOMETRY)


def test_lamps_do_not_hide_each_other(blender, plane) -> None:
    """A ray of a surface that meets a lamp goes on to the background: here a larger one, whose light is mostly found
    that way."""
    near = read(lux("SphereLight", "float inputs:radius = 0.6", at=(0, 0, -3)))
    large = read(lux("DiskLight", "float inputs:radius = 3"))
    wanted = by.sphere(L, (0, 0, -3), 0.6, P, N) + np.pi * L * 9 / (9 + 4)
    assert measured(blender, plane([*near, *large])) == pytest.approx(wanted, rel=RADIOMETRY)


@pytest.mark.parametrize(
    "values",
    [
        {"emission": (np.nan, 1, 1)},
        {"emission": (-1.0, 1, 1)},
        {"radius": -1.0},
        {"radius": np.inf},
    ],
)
def test_lamps_that_cannot_be_are_named(blender, plane, values) -> None:
    (light,) = read(lux("SphereLight"))
    with pytest.raises(UnsupportedError, match=r"^/Light: .*; "):
        measured(blender, plane([replace(light, **values)]), samples=1)


@pytest.mark.parametrize(
    ("size_m", "distance_m"),
    [(MAX_DISTANCE_M / 200, MAX_DISTANCE_M / 2), (2 * MIN_SIZE_M, 1.0)],
    ids=["farthest", "smallest"],
)
def test_a_sphere_at_the_end_of_what_is_accepted_shines(blender, plane, size_m, distance_m) -> None:
    bright = EMISSIONS.high / L / 2 if size_m < 1 else 1
    exposure = f"float inputs:exposure = {np.log2(bright)}"
    lamp = read(lux("SphereLight", f"float inputs:radius = {size_m}", exposure, at=(0, 0, distance_m - 4)))
    found = measured(blender, plane(lamp), samples=256)
    wanted = by.sphere(L * bright, (0, 0, distance_m - 4), size_m, P, N)
    assert found == pytest.approx(wanted, rel=RADIOMETRY)
