"""Lights with a position: sphere, disk, rectangle and cylinder, as radiance, size and pose.

Normalised, the emission is divided by the surface that emits, in the stage's units of area, with all scaling: a
sphere's 4 pi r2, a disk's and a rectangle's one side, a cylinder's mantle without its ends (which emit nothing).
Source: UsdLux's schema text on LightAPI's normalize, "Area Lights"; hdEmbree.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.light import AreaLight, CylinderLight, DiskLight, PointLight, RectLight, SphereLight
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.emission import casts_shadows, emission
from spin_usd.stage.read.light_texture import read_texture
from spin_usd.stage.read.shaping import read_shaping
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.transforms import SHEAR_TOLERANCE
from spin_usd.stage.usd.values import AT_LEAST_0, read, value_in

MIN_SIZE_M = 1e-9  # squared twice it is still above the smallest float32, 1e-38
POINT_AREA = 1.0  # for a sphere of radius 0: 4 pi times it emits as much as a point does
MAX_DISTANCE_M = 1e15  # a tenth of a light year; squared distances overflow float32 at 2e19 m


def read_area_light(prim: Usd.Prim, space: CameraSpace, images: Images) -> AreaLight:
    """Read the light, in camera axes. Raises StageError, UnsupportedError."""
    time = space.time
    T_world_light, scale = _axes(prim, space.world, space.metres)
    unlit = _unlit(prim, time, scale, space.from_world(T_world_light))
    lit = replace(
        unlit.scaled(space.metres),
        emission=emission(prim, time, unlit.area or POINT_AREA),
        shaping=read_shaping(prim, time),
        shadows=casts_shadows(prim, time),
    )
    if isinstance(lit, RectLight):
        lit = replace(lit, image=read_texture(prim, time, images))
    _check_float32(lit)
    return _point(lit, prim, time) if isinstance(lit, SphereLight) else lit


def _check_float32(light: AreaLight) -> None:
    """Raise UnsupportedError for a size or a distance that float32 cannot carry."""
    distance, size = float(np.linalg.norm(light.T_cam_light.translation)), max(light.size)
    for name, value in (("distance from the camera", distance), ("size", size)):
        if not value <= MAX_DISTANCE_M:
            found = f"its {name} is {value:g} m, more than {MAX_DISTANCE_M:g} m"
            raise UnsupportedError(found, where=light.path, do="use a DistantLight")
    if 0 < min(light.size) < MIN_SIZE_M:
        found = f"its size is {min(light.size):g} m, less than {MIN_SIZE_M:g} m"
        raise UnsupportedError(found, where=light.path, do="make it larger, or a SphereLight of radius 0")


def _unlit(prim: Usd.Prim, time: Usd.TimeCode, scale: Float, T_cam_light: Transform) -> AreaLight:
    """Read the light without its emission, its lengths in stage units, scaled."""
    x, y, _ = scale
    common: dict[str, Any] = {"path": str(prim.GetPath()), "T_cam_light": T_cam_light, "emission": (0.0, 0.0, 0.0)}
    light: AreaLight
    if prim.IsA(UsdLux.RectLight):
        width, height = _length(prim, "inputs:width", time), _length(prim, "inputs:height", time)
        light = RectLight(width=width * x, height=height * y, **common)
    elif prim.IsA(UsdLux.DiskLight):
        radius = _length(prim, "inputs:radius", time)
        light = DiskLight(radius_x=radius * x, radius_y=radius * y, **common)
    elif prim.IsA(UsdLux.CylinderLight):
        length, radius = _length(prim, "inputs:length", time), _length(prim, "inputs:radius", time)
        light = CylinderLight(length=length * x, radius=radius * _equal(scale[1:], prim), **common)
    else:
        return SphereLight(radius=_length(prim, "inputs:radius", time) * _equal(scale, prim), **common)
    if min(light.size) == 0:
        raise StageError("has no surface that could emit", where=prim.GetPath(), do="give it a size above 0")
    return light


def _length(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> float:
    return float(value_in(prim, name, AT_LEAST_0, time))


def _point(light: SphereLight, prim: Usd.Prim, time: Usd.TimeCode) -> AreaLight:
    """Turn a sphere that is treated as a point into one that is as bright from afar; also a normalised one of radius
    0."""
    radius, normalized = light.radius, read(UsdLux.LightAPI(prim).GetNormalizeAttr(), time)
    if radius > 0 and not read(UsdLux.SphereLight(prim).GetTreatAsPointAttr(), time):
        return light
    if radius == 0 and not normalized:
        do = "give it a radius, or set inputs:normalize"
        raise StageError("has no surface that could emit", where=prim.GetPath(), do=do)
    visible_area = light.facing_area if radius > 0 else 1 / 4  # a sphere shows a disk, a quarter of its 4 pi r2
    r, g, b = (float(value * visible_area) for value in light.emission)
    return PointLight(
        path=light.path,
        T_cam_light=light.T_cam_light,
        emission=(r, g, b),
        shaping=light.shaping,
        shadows=light.shadows,
    )


def _axes(prim: Usd.Prim, world: UsdGeom.XformCache, metres: float) -> tuple[Transform, Float]:
    """Return the light's axes in the world, and the scale (3,) along them. Raises StageError for shear or a mirror."""
    matrix = np.array(world.GetLocalToWorldTransform(prim))
    linear, where = matrix[:3, :3].T, prim.GetPath()
    scale = np.linalg.norm(linear, axis=0)
    if not np.isfinite(matrix).all() or scale.min() == 0 or np.linalg.det(linear / scale.max()) <= 0:
        raise StageError("its transform is mirrored, flat or not finite", where=where, do="give it a plain rotation")
    axes = linear / scale
    if np.abs(axes.T @ axes - np.eye(3)).max() > SHEAR_TOLERANCE:
        raise StageError("its transform shears it", where=where, do="scale it by its own size instead")
    u, _, vt = np.linalg.svd(axes)
    return Transform(to="world", of="light", rotation=u @ vt, translation=matrix[3, :3] * metres), scale


def _equal(scale: Float, prim: Usd.Prim) -> float:
    """Return the scale factor of a round light. Raises UnsupportedError where the factors differ."""
    if scale.max() - scale.min() > SHEAR_TOLERANCE * scale.max():
        found = f"is a {prim.GetTypeName()} scaled unequally (by {scale.max() / scale.min():.6g})"
        raise UnsupportedError(found, where=prim.GetPath(), do="scale it equally: only round ones are rendered")
    return float(scale.mean())
