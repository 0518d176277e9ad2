"""Every light of UsdLux and every switch of its units: the radiance of a white Lambertian plane against the formulas.

From the text of a stage to Blender's pixels. Stage and camera share their axes: x right, y up, the camera at the origin
looking along -z. The point that is measured lies 4 m before the camera on a plane that faces it.
"""

from dataclasses import replace

import irradiance as by
import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.material import Material
from spin_usd.stage.images import Images
from spin_usd.stage.lights import LightReader

SAMPLES = 4096
RADIOMETRY = 0.005  # relative: what is promised of a light at SAMPLES
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


def lux(kind, *attributes, at=(0, 0, -2), turn=None, scale=(1, 1, 1), api=(), metadata="metersPerUnit = 1"):
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
    return LightReader(stage, Images()).read(time, T_WORLD_USDCAM, UsdGeom.XformCache(time), metres)


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
    return by.surface(factor or (lambda d: np.ones(len(d))), *by.moved(pieces, R, np.array(at)), P, N)


WARM = np.array(UsdLux.BlackbodyTemperatureAsRgb(3000))
SHAPED = ("ShapingAPI",)
SOFT = ("float inputs:shaping:cone:angle = 40", "float inputs:shaping:cone:softness = 0.7")
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
        lux("RectLight", "float inputs:width = 100", "float inputs:height = 100", at=cm(OFF), metadata="metersPerUnit = 0.01"),
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
        by.point(L * np.pi / 4, OFF, P, N) * by.shaping(DOWN, cone=40, softness=0.7)(by.unit(P - OFF)[None])[0],
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
        L * integral(by.sphere_pieces(0.5), at=OFF, factor=by.shaping(DOWN, cone=40, softness=0.7)),
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
        lux("RectLight", "float inputs:shaping:focus = 2", "color3f inputs:shaping:focusTint = (1, 0.5, 0)", at=OFF, api=SHAPED),
        [
            L * integral(by.rect_pieces(1, 1), at=OFF, factor=lambda d, t=t: t + (1 - t) * by.shaping(DOWN, focus=2)(d))
            for t in (1.0, 0.5, 0.0)
        ],
    ),
    "rectangle, soft cone": (
        lux("RectLight", *SOFT, at=OFF, api=SHAPED),
        L * integral(by.rect_pieces(1, 1), at=OFF, factor=by.shaping(DOWN, cone=40, softness=0.7)),
    ),
    "cylinder, soft cone": (
        lux("CylinderLight", *SOFT, at=OFF, api=SHAPED),
        L * integral(by.tube_pieces(1, 0.5), at=OFF, factor=by.shaping(DOWN, cone=40, softness=0.7)),
    ),
}


@pytest.fixture
def plane(make_scene, square):
    """A function that makes the scene of a white plane and lights, and one that measures it."""
    return lambda lights: make_scene(*square, camera=CAMERA, lights=lights)


def measured(blender, scene, samples=SAMPLES):
    """Irradiance (3,) of the white plane's middle."""
    return np.pi * blender.radiance(scene, samples=samples, seed=1).rgb.astype(float).mean((0, 1))


@pytest.mark.parametrize("case", CASES)
def test_irradiance(blender, plane, case, record_property):
    text, expected = CASES[case]
    expected = np.broadcast_to(np.asarray(expected, float), 3)
    found = measured(blender, plane(read(text)))
    record_property("expected", expected.tolist())
    record_property("found", found.tolist())
    assert found == pytest.approx(expected, rel=RADIOMETRY, abs=DARK * L)
