"""Small scenes made by numpy."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.scene.body import Body
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import FrameId, OneBody
from spin_usd.scene.sensor import Sensor
from spin_usd.scene.target import Part, Target
from tests.cases import scenes

LAMBERT = Material(path="/white", diffuse_color=(1, 1, 1), use_specular_workflow=True)  # no specular at all
# The SPEED+ camera at a tenth of its resolution.
SPEEDPLUS = replace(
    scenes.SPEEDPLUS, width=192, height=120, fx=scenes.SPEEDPLUS.fx / 10, fy=scenes.SPEEDPLUS.fy / 10, cx=96, cy=60
)


@pytest.fixture(scope="session")
def speedplus():
    return SPEEDPLUS


@pytest.fixture(scope="session")
def lambert():
    return LAMBERT


@pytest.fixture(scope="session")
def make_scene():
    return build_scene


@pytest.fixture(scope="session")
def needles():
    """(points, faces) of a tube of needle triangles with fan-shaped ends, a dense ball and a plate; none touch."""
    return join(
        tube(sides=180, radius=0.3, length=1.4), ball(rings=40, radius=0.35, centre=(0.75, 0.1, 0.2)), plate(-0.8)
    )


@pytest.fixture(scope="session")
def square():
    """A square of side 2 in the plane z = 0 of the body, seen from -z: (points, faces)."""
    return np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])


def build_scene(
    points, faces, *, camera=SPEEDPLUS, q=(1, 0, 0, 0), t=(0, 0, 4), materials=(LAMBERT,), lights=(), **mesh_fields
):
    """A Scene of one part; `mesh_fields` replace face_material or corner_normals (flat faces unless given)."""
    a, b, c = (np.asarray(points, float)[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    fields = {
        "face_part": np.ones(len(faces)),
        "face_material": np.zeros(len(faces)),
        "corner_normals": np.repeat(normal[:, None], 3, axis=1),
    }
    mesh = Mesh(points=points, faces=faces, **{**fields, **mesh_fields})
    part = Part(id=1, path="/T/part", name="part", class_name="unknown")
    pose = Transform.from_quaternion(to="cam", of="body", q=np.array(q) / np.linalg.norm(q), t=t)
    target = Target(path="/T", name="T", mesh=mesh, parts=(part,), materials=tuple(materials))
    return OneBody(
        frame=FrameId(index=0, name="frame", time_code=0.0),
        camera=camera,
        bodies=(Body(id=1, target=target, T_cam_body=pose),),
        lights=tuple(lights),
        sensor=Sensor(),
    )


def join(*meshes):
    offsets = np.cumsum([0] + [len(points) for points, _ in meshes[:-1]])
    faces = [faces + offset for (_, faces), offset in zip(meshes, offsets, strict=True)]
    return np.concatenate([points for points, _ in meshes]), np.concatenate(faces)


def tube(sides, radius, length):
    """A closed tube along y, its sides as thin as `sides` makes them."""
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = radius * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], -1)
    up = np.array([0, length / 2, 0])
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    caps = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    faces = [[i, i + sides, j], [j, i + sides, j + sides], [caps[0], i, j], [caps[1], j + sides, i + sides]]
    return np.concatenate([ring - up, ring + up, [-up, up]]), np.concatenate([np.stack(f, -1) for f in faces])


def ball(rings, radius, centre):
    """A sphere of 2 * rings meridians and `rings` parallels, closed by needle fans at its poles."""
    polar, azimuth = np.meshgrid(
        np.linspace(1e-3, np.pi - 1e-3, rings), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False), indexing="ij"
    )
    unit = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    row, column = np.meshgrid(np.arange(rings - 1), np.arange(2 * rings), indexing="ij")
    a, b = row * 2 * rings + column, row * 2 * rings + (column + 1) % (2 * rings)
    c, d = a + 2 * rings, b + 2 * rings
    faces = np.concatenate([np.stack(f, -1).reshape(-1, 3) for f in ([a, c, b], [b, c, d])])
    return radius * unit.reshape(-1, 3) + centre, faces


def plate(x, strips=50):
    """A square plate of side 1 across x, cut into strips."""
    edge = np.linspace(-0.5, 0.5, strips + 1)
    points = np.concatenate([np.stack([0 * edge + x, edge, 0 * edge + side], -1) for side in (-0.5, 0.5)])
    i = np.arange(strips)
    faces = np.concatenate(
        [np.stack([i, i + 1, i + strips + 1], -1), np.stack([i + 1, i + strips + 2, i + strips + 1], -1)]
    )
    return points, faces
