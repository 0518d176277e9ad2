"""Cameras, meshes, poses and scenes that several test files build on."""

from dataclasses import fields as dataclass_fields
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.scene.body import Body
from spin_usd.scene.instances import Instances
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import FrameId, OneBody, Scene, Shutter
from spin_usd.scene.sensor import Sensor
from spin_usd.scene.target import Part, Target

SPEEDPLUS = Camera(
    width=1920,
    height=1200,
    fx=2988.5795163815555,
    fy=2988.3401159176124,
    cx=960,
    cy=600,
    distortion=(-0.22383016606510672, 0.51409797089106379, -0.00066499611998340662, -0.00021404771667484594,
                -0.13124227429077406),
)  # fmt: skip
# Half a field of view of 40 degrees and lenses that bend it by tens of pixels; the last folds just outside the frame.
BARREL = Camera(width=320, height=240, fx=220, fy=221, cx=158, cy=122, distortion=(-0.28, 0.08, 1e-3, -2e-3, -0.008))
PINCUSHION = Camera(width=320, height=240, fx=260, fy=259, cx=163, cy=118, distortion=(0.25, 0.05, -1e-3, 1e-3, 0))
FOLDING = Camera(width=320, height=240, fx=300, fy=300, cx=160, cy=120, distortion=(0.3, -0.45, 0, 0, 0))
GREY = Material(path="/m")
SMALL = Camera(width=64, height=48, fx=70, fy=71, cx=31, cy=25, distortion=(-0.2, 0.05, 1e-3, 2e-3, 0))


def target(points, faces, *, parts=None, materials=(GREY,), **fields):
    """A Target with flat faces; `parts` (F,) are ids from 1."""
    points, faces = np.asarray(points, float), np.asarray(faces)
    a, b, c = (points[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    defaults = {
        "face_part": np.ones(len(faces)) if parts is None else parts,
        "face_material": np.zeros(len(faces)),
        "corner_normals": np.repeat(normal[:, None], 3, axis=1),
    }
    mesh = Mesh(points=points, faces=faces, **{**defaults, **fields})
    named = tuple(
        Part(id=i, path=f"/T/p{i}", name=f"p{i}", class_name="c") for i in range(1, int(mesh.face_part.max()) + 1)
    )
    return Target(path="/T", name="T", mesh=mesh, parts=named, materials=tuple(materials))


def copied(shape, matrices):
    """A mesh of nothing but the `shape`, of one part, in all places of `matrices` (N, 3, 4)."""
    count, nothing = len(matrices), np.zeros((0, 3))
    places = Instances(shape=shape, matrices=matrices, parts=np.ones((count, 2)), groups=np.zeros(count))
    return Mesh(
        points=nothing,
        faces=nothing,
        face_part=np.zeros(0),
        face_material=np.zeros(0),
        corner_normals=np.zeros((0, 3, 3)),
        instances=(places,),
    )


def pose(q=(1, 0, 0, 0), t=(0, 0, 4)):
    return Transform.from_quaternion(to="cam", of="body", q=np.array(q) / np.linalg.norm(q), t=t)


def scene(target, *, camera=SMALL, T_cam_body=None, others=(), lights=(), sensor=None, name="frame", **fields):
    """A scene of the target, and of `others`, which are bodies."""
    made = Scene if others else OneBody
    return made(
        frame=FrameId(index=0, name=name, time_code=0.0),
        camera=camera,
        bodies=(Body(id=1, target=target, T_cam_body=T_cam_body or pose()), *others),
        lights=tuple(lights),
        sensor=sensor or Sensor(),
        **fields,
    )


def with_first(scene, *, others=None, **fields):
    """The same scene with another first body: another target, T_cam_body or poses; and with `others` beside it."""
    first, *before = scene.bodies
    bodies = (replace(first, **fields), *(before if others is None else others))
    rest = {each.name: getattr(scene, each.name) for each in dataclass_fields(scene) if each.name != "bodies"}
    return (Scene if len(bodies) > 1 else OneBody)(bodies=bodies, **rest)


def in_motion(scene, poses, **fields):
    """The same scene with its first body in motion; `fields` are the shutter's."""
    first = replace(scene.bodies[0], poses=tuple(poses))
    return replace(scene, bodies=(first, *scene.bodies[1:]), shutter=Shutter(**fields))


def soup(seed, count=40, size=1.0):
    """`count` random triangles, each a part of its own: (points, faces, parts)."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-size, size, (count, 1, 3))
    points = (middle + rng.normal(0, size / 3, (count, 3, 3))).reshape(-1, 3)
    return points, np.arange(3 * count).reshape(-1, 3), np.arange(1, count + 1)


def box(low=(-0.5, -0.5, -0.5), high=(0.5, 0.5, 0.5)):
    """A closed box: (points, faces), counter-clockwise seen from outside."""
    corners = np.array([[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # fmt: skip  # noqa: E501
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))])


def boxes():
    """Two boxes in front of a plate, which light one another: (points, faces)."""
    each = [
        box((-0.6, -0.4, -0.5), (0.1, 0.4, 0.5)),
        box((0.4, -0.1, -0.4), (0.9, 0.4, 0.1)),
        box((-0.9, -0.6, 0.6), (1.0, 0.7, 0.7)),
    ]
    points = np.concatenate([corners for corners, _ in each])
    return points, np.concatenate([faces + len(corners) * i for i, (corners, faces) in enumerate(each)])


@st.composite
def unit_quaternions(draw):
    """Uniform directions of four-space, and the places where formulas break: near identity and near half turns."""
    q = np.array(draw(st.tuples(*[st.floats(-1, 1, allow_subnormal=False)] * 4)))
    near = draw(st.sampled_from([None, 0, 1, 2, 3]))
    if near is not None:
        q = q * draw(st.sampled_from([0.0, 1e-12, 1e-8, 1e-4])) + np.eye(4)[near]
    norm = np.linalg.norm(q)
    return q / norm if norm > 1e-3 else np.array([1.0, 0, 0, 0])
