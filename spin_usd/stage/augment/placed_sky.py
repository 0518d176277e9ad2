"""Sun, planets and stars of a stage placed for each picture, where it is known where they are."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, Vt

from spin_usd.basics.arrays import Float
from spin_usd.geometry.rotation import quaternion_from_matrix
from spin_usd.stage.augment.attribute_change import BaseStage, ChangedAttribute
from spin_usd.stage.augment.lights import find_sun, order
from spin_usd.stage.augment.sampled_values import SampledValue, SampledValues, overlaid, sampled_values
from spin_usd.stage.author.paths import ENVIRONMENT
from spin_usd.stage.author.poses_layer import T_WORLD_CAM
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import quatd, vec3d

SUN_RADIUS = 695.7e6  # metres: IAU 2015 resolution B3
ASTRONOMICAL_UNIT = 149_597_870_700.0  # metres; lights of the Sun state its irradiance at this distance


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedSky:
    """The sky in N pictures, in the camera's axes: rotations (N, 3, 3) to them, positions (N, 3) in metres."""

    sun: Float
    planets: Mapping[str, tuple[Float, Float]]
    """Rotation and place by the prim's name."""
    stars: Float
    """The rotation from the axes in which the stars are listed."""
    directions: Float
    """(M, 3) unit vectors to the stars."""
    magnitudes: Float
    """(M,)"""
    credit: str
    """Whose catalogue it is."""

    def values(self, stage: Usd.Stage, base: BaseStage) -> SampledValues:
        """Return the values that place the stage's Sun and its planets and stars, if any. Raises InputError for a stage
        without a Sun."""
        far = np.linalg.norm(self.sun, axis=1)
        directions = [tuple(row) for row in (self.sun / far[:, None]).tolist()]
        factors = ((ASTRONOMICAL_UNIT / far) ** 2).tolist()
        light = sampled_values(base, {}, {"sun.direction": directions, "sun.factor": factors})
        there = Usd.PrimRange(stage.GetPrimAtPath(ENVIRONMENT))
        prims = {prim.GetName(): prim for prim in there}
        found = [self._sun_angle(base, far)]
        for name, (rotations, places) in self.planets.items():
            if name in prims and prims[name].HasAPI(schema.PLANET_API):
                found += _placed(base, prims[name], rotations, places / base.metres)
        for prim in prims.values():
            if prim.HasAPI(schema.STARS_API):
                found += [*_placed(base, prim, self.stars, None), *self._listed(prim)] if len(self.magnitudes) else ()
                found += [] if len(self.magnitudes) else [_hidden(prim)]
        return overlaid(SampledValues(attributes=tuple(found), credit=self.credit), light)

    def _sun_angle(self, base: BaseStage, far: Float) -> SampledValue:
        angle = ChangedAttribute(prim=str(find_sun(base).GetPath()), name="inputs:angle", type="float")
        degrees = np.degrees(2 * np.arcsin(SUN_RADIUS / far)).tolist()
        return SampledValue(attribute=angle, samples=tuple(zip(base.times, degrees, strict=True)))

    def _listed(self, prim: Usd.Prim) -> Iterator[SampledValue]:
        listed: dict[str, tuple[str, Any]] = {
            schema.STARS_DIRECTIONS: ("double3[]", Vt.Vec3dArray.FromNumpy(np.ascontiguousarray(self.directions))),
            schema.STARS_MAGNITUDES: ("double[]", Vt.DoubleArray.FromNumpy(np.ascontiguousarray(self.magnitudes))),
        }
        for name, (kind, value) in listed.items():
            attribute = ChangedAttribute(prim=str(prim.GetPath()), name=name, type=kind)
            yield SampledValue(attribute=attribute, value=value)


def _hidden(prim: Usd.Prim) -> SampledValue:
    attribute = ChangedAttribute(prim=str(prim.GetPath()), name="visibility", type="token")
    return SampledValue(attribute=attribute, value="invisible")


def _placed(base: BaseStage, prim: Usd.Prim, rotations: Float, places: Float | None) -> Iterator[SampledValue]:
    """Yield the prim's pose in each picture, where its parent has the world's axes."""
    path, world = str(prim.GetPath()), T_WORLD_CAM.rotation
    turns = [quatd(quaternion_from_matrix(world @ each)) for each in rotations]
    orient = ChangedAttribute(prim=path, name="xformOp:orient", type="quatd")
    operations = [orient]
    yield SampledValue(attribute=orient, samples=tuple(zip(base.times, turns, strict=True)))
    if places is not None:
        translate = ChangedAttribute(prim=path, name="xformOp:translate", type="double3")
        operations.insert(0, translate)
        rows = [vec3d(row) for row in T_WORLD_CAM.directions(places) + 0.0]  # no negative zeros
        yield SampledValue(attribute=translate, samples=tuple(zip(base.times, rows, strict=True)))
    attribute, value = order(prim, *operations)
    yield SampledValue(attribute=attribute, value=value)
