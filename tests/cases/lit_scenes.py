"""Targets, lights and scenes that differ in what they need of a path tracer."""

from dataclasses import replace

import numpy as np

from spin_usd.geometry.transform import Transform
from spin_usd.scene.environment import Environment, Planet
from spin_usd.scene.light import CylinderLight, DistantLight, DomeLight, SphereLight
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Image, Texture
from tests.cases import scenes

PINHOLE = replace(scenes.SMALL, distortion=(0.0,) * 5)
MATT = Material(path="/matt", diffuse_color=(0.7, 0.6, 0.5), ior=1.0, roughness=0.9)
DARK = replace(MATT, path="/dark", diffuse_color=(0.04, 0.03, 0.05))
METAL = Material(path="/metal", diffuse_color=(0.6, 0.5, 0.4), metallic=0.7)
GLOWING = replace(MATT, path="/glowing", emissive_color=(1.0, 0.0, 0.0))
SUN = DistantLight(path="/Sun", direction_cam=(0.0, 0.6, 0.8), irradiance=(1361.0,) * 3)
AT = Transform(to="cam", of="light", rotation=np.eye(3), translation=np.array([2.0, 0, 2]))
BALL = SphereLight(path="/Ball", radius=0.2, T_cam_light=AT, emission=(1.0,) * 3)
TUBE = CylinderLight(path="/Tube", length=1.0, radius=0.1, T_cam_light=AT, emission=(1.0,) * 3)
DOME = DomeLight(path="/Dome", T_cam_dome=replace(AT, of="dome"), radiance=(1.0,) * 3)
EARTH = Planet(path="/Earth", T_cam_planet=replace(AT, of="planet", translation=np.array([0, 7e6, 0.0])), radii=(6.4e6,) * 3, albedo=(0.3,) * 3)  # fmt: skip  # noqa: E501


def a_scene(*materials, lights=(SUN,), points_faces=None, camera=scenes.SMALL, primvars=None, planets=(), **fields):
    points, faces = points_faces or corner()
    material = np.arange(len(faces)) % max(len(materials), 1)
    target = scenes.target(points, faces, materials=materials, face_material=material, primvars=primvars or {})
    made = scenes.scene(target, camera=camera, lights=lights)
    return replace(made, environment=Environment(planets=tuple(planets)), **fields)


def corner():
    """A floor and the wall behind it, which see one another."""
    points, faces = scenes.box()
    return points, faces[[6, 7, 10, 11]]


def image(*values):
    """Of one row of texels of these colours."""
    pixels = np.ones((1, len(values), 4), np.float32)
    pixels[..., :3] = np.array(values)[..., None] if np.ndim(values[0]) == 0 else values
    return Image(name="image", pixels=pixels)


def textured(*values, **fields):
    return Texture(path="/t", image=image(*values), output="rgb" if np.ndim(values[0]) else "r", **fields)
