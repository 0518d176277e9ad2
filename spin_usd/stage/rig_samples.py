"""Light and background that change from picture to picture, as time samples on a rig: time code i is picture i.

Directions are in the camera frame of an authored stage, whose camera stands at the origin and looks along +Y.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pxr import Sdf, UsdGeom

from spin_usd.errors import InputError
from spin_usd.stage import schema
from spin_usd.stage.convert import quatd, vec3d
from spin_usd.stage.poses_layer import T_WORLD_CAM

EARTH_RADIUS = 6378137.0  # metres. Source: WGS 84, semi-major axis
ALTITUDE = 700e3  # metres, where none is sampled: that of stages/environments
PLACE, TURN, ORDER = "xformOp:translate", "xformOp:orient", "xformOpOrder"

type Samples = Mapping[str, Sequence[Any]]


def set_sun(rig: Sdf.Layer, samples: Samples) -> None:
    """Turn the rig's only DistantLight named Sun by `sun.direction` (unit vectors to the Sun, one for each picture).

    Raises InputError where there is none.
    """
    if "sun.direction" not in samples:
        return
    sun = _only(rig, lambda prim: prim.typeName == "DistantLight" and prim.name == "Sun", "sun.direction")
    _clear_ops(sun)
    towards = [T_WORLD_CAM.directions(np.array(d)) for d in _whole(samples, "sun.direction")]
    _author(sun, TURN, Sdf.ValueTypeNames.Quatd, [quatd(_turn_of_z(d)) for d in towards])
    _order(sun, [TURN])


def set_planet(rig: Sdf.Layer, samples: Samples) -> None:
    """Place, turn and hide the rig's only planet by `earth.direction` (to its centre), `earth.altitude` (metres),
    `earth.attitude` (w, x, y, z, in the stage's axes) and `earth.visible`, as far as they are sampled.

    Raises InputError where there is no planet.
    """
    mine = sorted(name for name in samples if name.startswith("earth."))
    if not mine:
        return
    planet = _only(rig, _is_planet, mine[0])
    if "earth.visible" in samples:
        tokens = [
            UsdGeom.Tokens.inherited if seen else UsdGeom.Tokens.invisible for seen in _whole(samples, "earth.visible")
        ]
        _author(planet, "visibility", Sdf.ValueTypeNames.Token, tokens)
    if "earth.attitude" in samples or "earth.direction" in samples:
        _place_planet(planet, samples)


def _place_planet(planet: Sdf.PrimSpec, samples: Samples) -> None:
    count = len(next(iter(samples.values())))
    facing = _whole(samples, "earth.direction") if "earth.direction" in samples else [(0.0, 0.0, 1.0)] * count
    heights = _whole(samples, "earth.altitude") if "earth.altitude" in samples else [ALTITUDE] * count
    turns = _whole(samples, "earth.attitude") if "earth.attitude" in samples else [(1.0, 0.0, 0.0, 0.0)] * count
    _clear_ops(planet)
    places = [
        T_WORLD_CAM.directions(np.array(d)) / np.linalg.norm(d) * (EARTH_RADIUS + h)
        for d, h in zip(facing, heights, strict=True)
    ]
    _author(planet, PLACE, Sdf.ValueTypeNames.Double3, [vec3d(np.round(p, 3) + 0.0) for p in places])
    _author(planet, TURN, Sdf.ValueTypeNames.Quatd, [quatd(np.array(q) / np.linalg.norm(q)) for q in turns])
    _order(planet, [PLACE, TURN])


def _author(prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, values: Sequence[Any]) -> None:
    """One value, or a time sample wherever the value is another than the one before, and the one before that."""
    spec = prim.properties.get(name) or Sdf.AttributeSpec(prim, name, kind)
    if all(value == values[0] for value in values):
        spec.default = values[0]
        return
    held = kind == Sdf.ValueTypeNames.Token
    for i, value in enumerate(values):
        if i in (0, len(values) - 1) or value != values[i - 1] or (value != values[i + 1] and not held):
            prim.layer.SetTimeSample(spec.path, float(i), value)


def _clear_ops(prim: Sdf.PrimSpec) -> None:
    for spec in [spec for spec in prim.properties if spec.name.startswith("xformOp")]:
        prim.RemoveProperty(spec)


def _order(prim: Sdf.PrimSpec, names: list[str]) -> None:
    order = Sdf.AttributeSpec(prim, ORDER, Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform)
    order.default = names


def _only(rig: Sdf.Layer, wanted: Any, parameter: str) -> Sdf.PrimSpec:
    """The only prim below the rig's root that is `wanted`."""
    root = rig.GetPrimAtPath(f"/{rig.defaultPrim}")
    found = [prim for prim in root.nameChildren if wanted(prim)]
    if len(found) != 1:
        what = f"{len(found)} prims of the {rig.defaultPrim.lower()} could take it"
        raise InputError(what, where=f"sample {parameter!r}", do="choose a rig with one, or do not sample it")
    return found[0]


def _is_planet(prim: Sdf.PrimSpec) -> bool:
    applied = prim.GetInfo("apiSchemas") if prim.HasInfo("apiSchemas") else None
    return applied is not None and schema.PLANET_API in applied.GetAddedOrExplicitItems()


def _whole(samples: Samples, name: str) -> Sequence[Any]:
    """The values of all pictures. Raises InputError where one has none: time samples hold until the next."""
    if any(value is None for value in samples[name]):
        raise InputError("is sampled in some parts only", where=f"sample {name!r}", do="sample it in all parts")
    return samples[name]


def _turn_of_z(direction: np.ndarray) -> np.ndarray:
    """The quaternion (4,), scalar first, of the least turn that takes +z to the unit vector `direction` (3,)."""
    x, y, z = direction
    q = np.array([1 + z, -y, x, 0]) if z > -1 else np.array([0.0, 1, 0, 0])
    turn: np.ndarray = q / np.linalg.norm(q) + 0.0
    return turn
