"""Settings of the planet behind the target: where it stands, how it lies, whether it is seen."""

import numpy as np
from pxr import Gf, Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from spin_usd.geometry.transform import Transform
from spin_usd.stage.augment.attribute_change import Base, Place, Setting, Values, placed_in_time
from spin_usd.stage.augment.lights import DIGITS, SAMPLED, camera_from_world, order
from spin_usd.stage.read.camera.camera import find_camera
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import quatd, vec3d
from spin_usd.stage.usd.transforms import between, placement
from spin_usd.stage.usd.visibility import PROXIES

PLACE = ("earth.direction", "earth.altitude", "earth.attitude")
MILLIMETRE = 3  # digits after the point to which a place is rounded


def find_planet(base: Base) -> Usd.Prim | None:
    """The planet that the parameters earth.* are of: the only one, else the one named Earth; None without any.

    Raises InputError where there are several and none has that name.
    """
    planets = [prim for prim in Usd.PrimRange.Stage(base.stage, PROXIES) if prim.HasAPI(schema.PLANET_API)]
    named = [prim for prim in planets if prim.GetName() == "Earth"]
    if len(planets) > 1 and len(named) != 1:
        raise InputError(f"the stage has {len(planets)} planets", where="earth.*", do="name one of them Earth")
    return (named if len(planets) > 1 else [*planets, None])[0]


def the_planet(base: Base, name: str) -> Usd.Prim:
    planet = find_planet(base)
    if planet is None:
        raise InputError("the stage has no planet", where=name, do="select an environment or background with one")
    return planet


def radii(base: Base, planet: Usd.Prim) -> tuple[float, float]:
    """Its least and greatest semi-axis, metres."""
    sizes = np.array(planet.GetAttribute(schema.PLANET_RADII).Get(base.first)) * base.metres
    return float(sizes.min()), float(sizes.max())


def planet_in_cam(base: Base, planet: Usd.Prim, time: float) -> Transform:
    """T_cam_planet as the stage has it."""
    world = UsdGeom.XformCache(Usd.TimeCode(time))
    camera = find_camera(base.stage)
    usdcam, own = (
        placement(world.GetLocalToWorldTransform(prim), frame=frame, metres=base.metres, where=prim.GetPath())
        for prim, frame in ((camera, "usdcam"), (planet, "planet"))
    )
    return T_CAM_USDCAM @ between(usdcam.transform, own.transform)


def planet_centres(base: Base, planet: Usd.Prim) -> Float:
    """(N, 3) or (1, 3) metres, camera axes, as the stage has them."""
    moves = placed_in_time(planet) or placed_in_time(find_camera(base.stage))
    return np.array(
        [planet_in_cam(base, planet, time).translation for time in (base.times if moves else base.times[:1])]
    )


def place(base: Base, names: tuple[str, ...]) -> Setting:
    """Where the planet stands and how it lies, of what is drawn and of what stays."""
    planet = the_planet(base, names[0])
    world = UsdGeom.XformCache(base.first)
    scale = placement(world.GetLocalToWorldTransform(planet), frame="p", metres=1.0, where=planet.GetPath()).scale
    if scale != 1:
        raise InputError(f"is scaled by {scale:g}", where=planet.GetPath(), do="scale its radii instead")
    camera, longest = find_camera(base.stage), radii(base, planet)[1]
    moves = placed_in_time(planet) or placed_in_time(camera)
    own = planet_in_cam(base, planet, base.times[0])
    to_parent = _parent_from_cam(base, planet, camera, base.times[0])

    def values(drawn: Values, time: float) -> tuple[Gf.Vec3d, Gf.Quatd]:
        T_cam_planet = planet_in_cam(base, planet, time) if moves else own
        T_parent_cam = _parent_from_cam(base, planet, camera, time) if moves else to_parent
        T_parent_planet = T_parent_cam @ _placed(T_cam_planet, drawn, longest)
        q = np.round(quaternion_from_matrix(T_parent_planet.rotation), DIGITS) + 0.0
        return vec3d(np.round(T_parent_planet.translation / base.metres, MILLIMETRE) + 0.0), quatd(q)

    path = str(planet.GetPath())
    places = (
        Place(prim=path, attribute=f"xformOp:translate{SAMPLED}", type="double3"),
        Place(prim=path, attribute=f"xformOp:orient{SAMPLED}", type="quatd"),
    )
    return Setting(parameters=names, places=places, values=values, varies=moves, fixed=(order(planet, *places),))


def centre(own: Float, drawn: Values, longest: float) -> Float:
    """(3,) where the planet's centre is, camera axes, metres: `own` where nothing of it is drawn."""
    far = float(np.linalg.norm(own))
    direction = np.array(drawn["earth.direction"]) if "earth.direction" in drawn else own / far
    away = float(drawn["earth.altitude"]) + longest if "earth.altitude" in drawn else far
    result: Float = direction / np.linalg.norm(direction) * away
    return result


def _placed(own: Transform, drawn: Values, longest: float) -> Transform:
    attitude = matrix_from_quaternion(drawn["earth.attitude"]) if "earth.attitude" in drawn else own.rotation
    moved = centre(own.translation, drawn, longest)
    return Transform(to="cam", of="planet", rotation=attitude, translation=moved)


def _parent_from_cam(base: Base, prim: Usd.Prim, camera: Usd.Prim, time: float) -> Transform:
    world = UsdGeom.XformCache(Usd.TimeCode(time))
    T_world_cam = camera_from_world(world, camera, base).inverse()
    if UsdGeom.Xformable(prim).GetResetXformStack():
        return Transform(to="parent", of="cam", rotation=T_world_cam.rotation, translation=T_world_cam.translation)
    matrix, where = world.GetParentToWorldTransform(prim), prim.GetPath().GetParentPath()
    return placement(matrix, frame="parent", metres=base.metres, where=where).transform.inverse() @ T_world_cam


def visible(base: Base, names: tuple[str, ...]) -> Setting:
    path = str(the_planet(base, names[0]).GetPath())
    at = Place(prim=path, attribute="visibility", type="token")
    tokens = {True: UsdGeom.Tokens.inherited, False: UsdGeom.Tokens.invisible}
    return Setting(parameters=names, places=(at,), values=lambda drawn, _: (tokens[drawn["earth.visible"]],))
