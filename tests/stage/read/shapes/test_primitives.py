"""USD's shapes: closed surfaces of the right volume, area and extent, with true normals."""

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.stage.read.shapes.primitives import SEGMENTS, read_gprim

# With t = 2 pi / SEGMENTS, a polygon in a circle loses t^2 / 6 of its area (1.3e-4), and the chords of a sphere's
# meridian lose another t^2 / 4 of its volume (2.0e-4).
VOLUME_TOLERANCE = 3.5e-4
CHORD_TOLERANCE = 1e-4  # of a radius near 1
EXTENT_TOLERANCE = 1e-6  # extents are float32
NORMAL_TOLERANCE = 1e-12
AXES = ("X", "Y", "Z")


def cap(radius, slope, side):
    """Volume beyond a circle of `radius`, of the sphere that meets a cone of this slope there; side -1: its far end."""
    sphere = radius * np.hypot(1, slope)
    height = sphere + side * radius * slope
    return np.pi * height**2 * (3 * sphere - height) / 3


SHAPES = {
    "Cube": ({"size": 3.0}, 27),
    "Sphere": ({"radius": 1.5}, 4 / 3 * np.pi * 1.5**3),
    "Cylinder": ({"radius": 0.5, "height": 3.0}, np.pi * 0.25 * 3),
    "Cylinder_1": ({"radiusBottom": 1.0, "radiusTop": 0.5, "height": 3.0}, np.pi * (1 + 0.5 + 0.25)),
    "Cone": ({"radius": 0.5, "height": 3.0}, np.pi * 0.25),
    "Capsule": ({"radius": 0.5, "height": 2.0}, np.pi * (0.25 * 2 + 4 / 3 * 0.125)),
    "Capsule_1": (
        {"radiusBottom": 1.0, "radiusTop": 0.5, "height": 3.0},
        np.pi * (1 + 0.5 + 0.25) + cap(1.0, 0.5 / 3, 1) + cap(0.5, 0.5 / 3, -1),
    ),
}


def define(kind, axis=None, **sizes):
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/Shape", kind)
    for name, value in sizes.items():
        prim.GetAttribute(name).Set(value)
    if axis:
        prim.GetAttribute("axis").Set(axis)
    return stage, prim


def shape(kind, axis=None, **sizes):
    stage, prim = define(kind, axis, **sizes)
    return read_gprim(stage.GetPrimAtPath(prim.GetPath()), Usd.TimeCode(0))


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("axis", AXES)
def test_shapes_are_closed_and_have_their_volume(kind, axis) -> None:
    sizes, volume = SHAPES[kind]
    t = shape(kind, axis if kind not in ("Cube", "Sphere") else None, **sizes)
    mesh = trimesh.Trimesh(t.points, t.corners, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(volume, rel=VOLUME_TOLERANCE)
    assert mesh.volume <= volume * (1 + 1e-12)  # inscribed


@pytest.mark.parametrize("kind", [*SHAPES, "Plane"])
@pytest.mark.parametrize("axis", AXES)
def test_extents_are_usds_own(kind, axis) -> None:
    sizes = {"width": 3.0, "length": 5.0} if kind == "Plane" else SHAPES[kind][0]
    axis = axis if kind not in ("Cube", "Sphere") else None
    _stage, prim = define(kind, axis, **sizes)
    t = read_gprim(prim, Usd.TimeCode(0))
    extent = UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(prim), Usd.TimeCode(0))
    tolerance = CHORD_TOLERANCE if kind == "Capsule_1" else EXTENT_TOLERANCE  # its widest circle is no ring of points
    np.testing.assert_allclose([t.points.min(0), t.points.max(0)], np.array(extent), atol=tolerance)


@pytest.mark.parametrize(("axis", "normal"), [("X", [1, 0, 0]), ("Y", [0, 1, 0]), ("Z", [0, 0, 1])])
def test_a_plane_faces_along_its_axis(axis, normal) -> None:
    t = shape("Plane", axis, width=3.0, length=5.0)
    mesh = trimesh.Trimesh(t.points, t.corners, process=False)
    np.testing.assert_allclose(mesh.face_normals, [normal, normal], atol=NORMAL_TOLERANCE)
    np.testing.assert_allclose(t.normals.reshape(-1, 3), [normal] * 6, atol=NORMAL_TOLERANCE)
    assert mesh.area == pytest.approx(15)


def test_a_cone_points_along_its_axis() -> None:
    t = shape("Cone", "X", radius=1.0, height=2.0)
    top = t.points[t.points[:, 0] > 0.999]
    np.testing.assert_allclose(top, [[1, 0, 0]], atol=1e-15)


def test_a_spheres_normals_are_radial_and_its_chords_short() -> None:
    t = shape("Sphere", radius=2.0)
    np.testing.assert_allclose(t.normals, t.points[t.corners] / 2, atol=NORMAL_TOLERANCE)
    edges = np.concatenate([t.points[t.corners[:, [i, (i + 1) % 3]]].mean(1) for i in range(3)])
    assert 1 - np.linalg.norm(edges, axis=1).min() / 2 < 2e-4
    assert 1 - np.cos(np.pi / SEGMENTS) < 1e-4


@pytest.mark.parametrize("kind", ["Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1"])
def test_round_normals_point_outwards_and_stand_on_the_surface(kind) -> None:
    t = shape(kind, **SHAPES[kind][0])
    facing = trimesh.Trimesh(t.points, t.corners, process=False).face_normals
    # A corner's true normal leans from its face's by half a step around, and half a step along a cap.
    assert ((t.normals * facing[:, None]).sum(-1) > np.cos(4 * np.pi / SEGMENTS)).all()


def test_left_handed_turns_a_shape_inside_out() -> None:
    stage, prim = define("Cube")
    UsdGeom.Gprim(prim).CreateOrientationAttr("leftHanded")
    t = read_gprim(prim, Usd.TimeCode(0))
    assert trimesh.Trimesh(t.points, t.corners, process=False).volume == pytest.approx(-8)
    assert stage


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        ("Cube", {"size": 0.0}),
        ("Sphere", {"radius": -1.0}),
        ("Cone", {"height": -0.5}),
        ("Plane", {"width": 0.0}),
    ],
)
def test_sizes_must_be_positive(kind, sizes) -> None:
    with pytest.raises(StageError, match=f"/Shape: its {next(iter(sizes))} is"):
        shape(kind, **sizes)
