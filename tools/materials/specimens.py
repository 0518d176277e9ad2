"""Pictures of the materials: each on a plate, a ball and a box of crinkled sides, above an Earth, under the Sun."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdShade

from materials.values import Array
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.blender.renderer import BlenderRenderer
from spin_usd.scene.body import Body
from spin_usd.scene.derived import srgb
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight, DomeLight
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import FrameId, OneBody
from spin_usd.scene.sensor import Sensor
from spin_usd.scene.target import Part, Target
from spin_usd.scene.texture import Image
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.preview_surface import read_template
from spin_usd.stage.read.bodies.texture_nodes import NodeReader

SIZE = (224, 178)  # pixels of a tile
CAMERA = Camera(width=SIZE[0], height=SIZE[1], fx=480.0, fy=480.0, cx=114.0, cy=86.0, distortion=(1e-3, 0, 0, 0, 0))
DISTANCE = 1.30  # metres from the camera to the specimens
SUNS = ((0.45, 0.55, 0.75), (-0.75, 0.35, 0.56))  # where its light goes to: x right, y down, z away from the camera
SUNLIGHT = 0.8 * np.pi  # so that white that faces the Sun has the radiance 0.8
SAMPLES = 128
BEHIND = 0.09  # radiance behind the specimens
PLATE, BALL, BOX = (0.34, 0.26), 0.105, 0.17  # metres: sides, radius, side
WRINKLE = 0.006  # of the box, metres
AT_CAMERA = Transform(to="cam", of="dome", rotation=np.eye(3), translation=np.zeros(3))


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Points (P, 3), faces (F, 3), and of each face corner its normal and st, (F, 3, 3) and (F, 3, 2)."""

    points: Array
    faces: Array
    normals: Array
    st: Array

    def placed(self, at: tuple[float, float, float], rotation: Array) -> "Surface":
        return replace(self, points=self.points @ rotation.T + at, normals=self.normals @ rotation.T)


def pictures(folder: Path, names: list[str]) -> dict[str, list[Array]]:
    """Of each material of the library in `folder`, (H, W, 3) of 0 to 1 under each Sun."""
    nodes, renderer = NodeReader(time=Usd.TimeCode.Default(), images=Images()), BlenderRenderer()
    made = {}
    for name in names:
        stage = Usd.Stage.Open(str(folder / f"{name}.usda"))
        material = read_template(UsdShade.Material(stage.GetDefaultPrim()), nodes).material({"st"})
        made[name] = [_picture(renderer, material, sun) for sun in SUNS]
    renderer.close()
    return made


def _picture(renderer: BlenderRenderer, material: Material, sun: tuple[float, float, float]) -> Array:
    scene = OneBody(
        frame=FrameId(index=0, name="frame", time_code=0.0),
        camera=CAMERA,
        bodies=(Body(id=1, target=_target(material), T_cam_body=replace(AT_CAMERA, of="body")),),
        lights=(_sun(sun), DomeLight(path="/Earth", T_cam_dome=AT_CAMERA, radiance=(1.0,) * 3, image=_earth())),
        sensor=Sensor(),
    )
    rgba = renderer.radiance(scene, Effort(samples=SAMPLES), seed=0).rgba.astype(float)
    picture = np.full((SIZE[1], SIZE[0], 3), BEHIND)
    picture[scene.picture_region.slices] = rgba[..., :3] + BEHIND * (1 - rgba[..., 3:])
    return np.asarray(srgb.encode(np.clip(picture, 0, 1)))


def _sun(way: tuple[float, float, float]) -> DistantLight:
    x, y, z = (np.array(way) / np.linalg.norm(way)).tolist()
    return DistantLight(path="/Sun", direction_cam=(x, y, z), irradiance=(SUNLIGHT,) * 3, angle=np.radians(0.53))


def _earth() -> Image:
    """A sky that is black above and lit by an Earth below, with a bright limb; its top row is the dome's +y, which is
    down in the camera's axes."""
    height = 64
    up = -np.cos((np.arange(height) + 0.5) / height * np.pi)  # of each row, of the camera's up
    ground = np.clip((-0.08 - up) / 0.05, 0, 1)[:, None] * np.array([0.34, 0.36, 0.39])
    limb = np.exp(-(((up + 0.06) / 0.04) ** 2))[:, None] * np.array([0.24, 0.28, 0.34])
    pixels = np.ones((height, 2 * height, 4), np.float32)
    pixels[..., :3] = (ground + limb)[:, None]
    return Image(name="earth", pixels=pixels)


def _target(material: Material) -> Target:
    parts = [
        _plate().placed((-0.115, -0.03, DISTANCE + 0.10), _turn(0.45, 0.15)),
        _ball().placed((0.17, -0.105, DISTANCE), np.eye(3)),
        _box().placed((0.145, 0.12, DISTANCE - 0.02), _turn(0.65, -0.45)),
    ]
    starts = np.cumsum([0, *(len(part.points) for part in parts[:-1])])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)])
    fields: dict[str, Any] = {
        "points": np.concatenate([part.points for part in parts]),
        "faces": faces,
        "face_part": np.ones(len(faces)),
        "face_material": np.zeros(len(faces)),
        "corner_normals": np.concatenate([part.normals for part in parts]),
        "primvars": {"st": np.concatenate([part.st for part in parts]).astype(np.float32)},
    }
    part = Part(id=1, path="/S/part", name="part", class_name="specimen")
    return Target(path="/S", name="S", mesh=Mesh(**fields), parts=(part,), materials=(material,))


def _turn(around_y: float, around_x: float) -> Array:
    """A rotation, by radians about y and then about x."""
    c, s, d, t = np.cos(around_y), np.sin(around_y), np.cos(around_x), np.sin(around_x)
    return np.asarray(np.array([[1, 0, 0], [0, d, -t], [0, t, d]]) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]))


def _sheet(count: int, at: Any) -> Surface:
    """A grid of `count` steps each way over the unit square: `at` gives of u, v to the right and up, seen from outside,
    points, normals and st."""
    u, v = np.meshgrid(np.linspace(0, 1, count + 1), np.linspace(0, 1, count + 1), indexing="xy")
    points, normals, st = (each.reshape(-1, each.shape[-1]) for each in at(u, v))
    row, column = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    low = (row * (count + 1) + column).ravel()
    high = low + count + 1
    faces = np.concatenate([np.stack([low, low + 1, high + 1], -1), np.stack([low, high + 1, high], -1)])
    return Surface(points=points, faces=faces, normals=normals[faces], st=st[faces])


def _plate() -> Surface:
    """Upright, towards the camera."""
    width, height = PLATE

    def at(u: Array, v: Array) -> tuple[Array, Array, Array]:
        points = np.stack([(u - 0.5) * width, (0.5 - v) * height, 0 * u], -1)
        return points, np.broadcast_to([0.0, 0.0, -1.0], points.shape), np.stack([u * width, v * height], -1)

    return _sheet(1, at)


def _ball() -> Surface:
    def at(u: Array, v: Array) -> tuple[Array, Array, Array]:
        polar, turn = np.pi * (0.002 + 0.996 * v), -2 * np.pi * u
        unit = np.stack([np.sin(polar) * np.sin(turn), np.cos(polar), np.sin(polar) * np.cos(turn)], -1)
        return BALL * unit, unit, np.stack([u * 2 * np.pi * BALL, v * np.pi * BALL], -1)

    return _sheet(64, at)


def _box() -> Surface:
    """A cube whose sides are wrinkled as a blanket around it is."""
    sides = []
    for index in range(6):
        normal = np.roll([1.0, 0, 0], index // 2) * (1 - 2 * (index % 2))
        right = np.roll([0, 1.0, 0], index // 2)
        up = np.cross(normal, right)

        def at(
            u: Array, v: Array, right: Array = right, up: Array = up, normal: Array = normal
        ) -> tuple[Array, Array, Array]:
            flat = BOX * ((u - 0.5)[..., None] * right + (v - 0.5)[..., None] * up + 0.5 * normal)
            points = _wrinkled(flat)
            across, along = np.gradient(points, axis=1), np.gradient(points, axis=0)
            facing = np.cross(across, along)
            return points, facing / np.linalg.norm(facing, axis=-1, keepdims=True), BOX * np.stack([u, v], -1)

        sides.append(_sheet(24, at))
    starts = np.cumsum([0, *(len(side.points) for side in sides[:-1])])
    return Surface(
        points=np.concatenate([side.points for side in sides]),
        faces=np.concatenate([side.faces + start for side, start in zip(sides, starts, strict=True)]),
        normals=np.concatenate([side.normals for side in sides]),
        st=np.concatenate([side.st for side in sides]),
    )


def _wrinkled(points: Array) -> Array:
    """Points (..., 3) moved along waves, the same where sides meet."""
    rng = np.random.default_rng(5)
    moved = points.copy()
    for _ in range(7):
        wave, way = rng.normal(size=3) * 30, rng.normal(size=3)
        bend = np.sin(points @ wave + rng.uniform(0, 2 * np.pi))
        moved += WRINKLE / 3 * np.sign(bend)[..., None] * np.sqrt(np.abs(bend))[..., None] * way / np.linalg.norm(way)
    return moved
