"""Parameters of the planet behind the target: position, attitude, visibility."""

from contextlib import suppress

import numpy as np
from pxr import Gf, Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from spin_usd.geometry.transform import Transform
from spin_usd.stage.augment.attribute_change import (
    AttributeChange,
    BaseStage,
    ChangedAttribute,
    ParameterValues,
    moves_in_time,
)
from spin_usd.stage.augment.lights import DIGITS, camera_from_world, order
from spin_usd.stage.read.camera import find_camera
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import quatd, vec3d
from spin_usd.stage.usd.transforms import SAMPLED, between, placement
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import PROXIES

PLANET = "earth."  # begins the names of its parameters
POSITION = ("earth.direction", "earth.altitude", "earth.attitude")
MILLIMETRE = 3  # digits after the point to which a position is rounded


def find_planet(stage: Usd.Stage) -> Usd.Prim | None:
    """Find the planet that the parameters earth.* set: the only one, else the one named Earth; None without any.

    Raises InputError if there are several and none has that name.
    """
    planets = [prim for prim in Usd.PrimRange.Stage(stage, PROXIES) if prim.HasAPI(schema.PLANET_API)]
    named = [prim for prim in planets if prim.GetName() == "Earth"]
    if len(planets) > 1 and len(named) != 1:
        raise InputError(f"the stage has {len(planets)} planets", where="earth.*", do="name one of them Earth")
    return (named if len(planets) > 1 else [*planets, None])[0]


def can_be_turned(base: BaseStage) -> bool:
    """Return whether the stage has a planet that `pose` can turn, and that does not move by itself."""
    with suppress(InputError):
        planet = find_planet(base.stage)
        return planet is not None and _scale(base, planet) == 1 and not moves_in_time(planet)
    return False


def _scale(base: BaseStage, planet: Usd.Prim) -> float:
    world = UsdGeom.XformCache(base.first)
    return placement(world.GetLocalToWorldTransform(planet), frame="p", metres=1.0, where=planet.GetPath()).scale


def the_planet(base: BaseStage, name: str) -> Usd.Prim:
    planet = find_planet(base.stage)
    if planet is None:
        raise InputError("the stage has no planet", where=name, do="select an environment or background with one")
    return planet


def radii(base: BaseStage, planet: Usd.Prim) -> tuple[float, float]:
    """Return the least and the greatest semi-axis of `planet`, metres."""
    sizes = np.array(read(planet.GetAttribute(schema.PLANET_RADII), base.first)) * base.metres
    return float(sizes.min()), float(sizes.max())


def planet_in_cam(base: BaseStage, planet: Usd.Prim, time: float) -> Transform:
    """T_cam_planet as the stage has it."""
    world = UsdGeom.XformCache(Usd.TimeCode(time))
    camera = find_camera(base.stage)
    usdcam, own = (
        placement(world.GetLocalToWorldTransform(prim), frame=frame, metres=base.metres, where=prim.GetPath())
        for prim, frame in ((camera, "usdcam"), (planet, "planet"))
    )
    return T_CAM_USDCAM @ between(usdcam.transform, own.transform)


def planet_centres(base: BaseStage, planet: Usd.Prim) -> Float:
    """Return the planet's centres (N, 3), or (1, 3) where nothing moves: metres, camera axes, as the stage has them."""
    moves = moves_in_time(planet) or moves_in_time(find_camera(base.stage))
    return np.array(
        [planet_in_cam(base, planet, time).translation for time in (base.times if moves else base.times[:1])]
    )


def pose(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Set the planet's pose: the sampled part of it, and for the rest the pose in the stage."""
    planet = the_planet(base, names[0])
    if (scale := _scale(base, planet)) != 1:
        raise InputError(f"is scaled by {scale:g}", where=planet.GetPath(), do="scale its radii instead")
    camera, longest = find_camera(base.stage), radii(base, planet)[1]
    moves = moves_in_time(planet) or moves_in_time(camera)
    own = planet_in_cam(base, planet, base.times[0])
    to_parent = _parent_from_cam(base, planet, camera, base.times[0])

    def values(sampled: ParameterValues, time: float) -> tuple[Gf.Vec3d, Gf.Quatd]:
        T_cam_planet = planet_in_cam(base, planet, time) if moves else own
        T_parent_cam = _parent_from_cam(base, planet, camera, time) if moves else to_parent
        T_parent_planet = T_parent_cam @ _sampled_pose(T_cam_planet, sampled, longest)
        q = np.round(quaternion_from_matrix(T_parent_planet.rotation), DIGITS) + 0.0
        return vec3d(np.round(T_parent_planet.translation / base.metres, MILLIMETRE) + 0.0), quatd(q)

    path = str(planet.GetPath())
    attributes = (
        ChangedAttribute(prim=path, name=f"xformOp:translate{SAMPLED}", type="double3"),
        ChangedAttribute(prim=path, name=f"xformOp:orient{SAMPLED}", type="quatd"),
    )
    return AttributeChange(
        parameters=names, attributes=attributes, values=values, varies=moves, fixed=(order(planet, *attributes),)
    )


def centre(own: Float, sampled: ParameterValues, longest: float) -> Float:
    """Return the planet's centre (3,), camera axes, metres: `own` where it is not sampled."""
    far = float(np.linalg.norm(own))
    direction = np.array(sampled["earth.direction"]) if "earth.direction" in sampled else own / far
    away = float(sampled["earth.altitude"]) + longest if "earth.altitude" in sampled else far
    result: Float = direction / np.linalg.norm(direction) * away
    return result


def _sampled_pose(own: Transform, sampled: ParameterValues, longest: float) -> Transform:
    attitude = matrix_from_quaternion(sampled["earth.attitude"]) if "earth.attitude" in sampled else own.rotation
    moved = centre(own.translation, sampled, longest)
    return Transform(to="cam", of="planet", rotation=attitude, translation=moved)


def _parent_from_cam(base: BaseStage, prim: Usd.Prim, camera: Usd.Prim, time: float) -> Transform:
    world = UsdGeom.XformCache(Usd.TimeCode(time))
    T_world_cam = camera_from_world(world, camera, base).inverse()
    if UsdGeom.Xformable(prim).GetResetXformStack():
        return Transform(to="parent", of="cam", rotation=T_world_cam.rotation, translation=T_world_cam.translation)
    matrix, where = world.GetParentToWorldTransform(prim), prim.GetPath().GetParentPath()
    return placement(matrix, frame="parent", metres=base.metres, where=where).transform.inverse() @ T_world_cam


def visible(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    path = str(the_planet(base, names[0]).GetPath())
    at = ChangedAttribute(prim=path, name="visibility", type="token")
    tokens = {True: UsdGeom.Tokens.inherited, False: UsdGeom.Tokens.invisible}
    return AttributeChange(
        parameters=names, attributes=(at,), values=lambda sampled, _: (tokens[sampled["earth.visible"]],)
    )
