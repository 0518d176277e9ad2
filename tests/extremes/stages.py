"""Extremes that only a stage can hold: far origins, units, quaternions that USD reads as another rotation.

A stage here is text with the numbers in full; the truth is worked out from that text in exact fractions.
"""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from tests.extremes import exact

ASTRONOMICAL_UNIT = 1.5e11  # metres
CAMERA_AT, TARGET_AT = (0.1, -0.2, 0.3), (1.4, 2.6, -5.1)  # metres
TURN = (0.36, 0.48, -0.64, 0.48)
TURN_OF_ALL = (0.5, -0.5, 0.5, 0.5)
LENS = (200, 120, 250.0, 240.0, 100.0, 60.0)  # width, height, fx, fy, cx, cy

STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    metersPerUnit = {unit}
)

def Xform "World"
{{
    {world}

    def Camera "Camera" (
        prepend apiSchemas = ["SpinLensAPI"]
    )
    {{
        int2 spin:lens:imageSize = ({lens[0]}, {lens[1]})
        double spin:lens:fx = {lens[2]}
        double spin:lens:fy = {lens[3]}
        double spin:lens:cx = {lens[4]}
        double spin:lens:cy = {lens[5]}
        {camera}
    }}

    def Xform "Target" (
        prepend apiSchemas = ["SpinTargetAPI"]
    )
    {{
        {target}

        def Cube "Box"
        {{
            double size = {size}
        }}
    }}
}}
"""


@dataclass(frozen=True, kw_only=True)
class StageCase:
    """Where the rig that holds camera and target stands, where each of them stands in it, metres, in a stage whose unit
    is `unit` metres. `world`: of the rig; `aside`: added to both, for stages that have no rig; `norm`: of the target's
    quaternion."""

    name: str
    world: tuple[float, float, float] | None = None
    aside: tuple[float, float, float] = (0.0, 0.0, 0.0)
    unit: float = 1.0
    norm: float = 1.0

    def text(self):
        return STAGE.format(
            unit=self.unit,
            lens=LENS,
            world=_pose(self._units(self.world), TURN_OF_ALL) if self.world else "",
            camera=_pose(self._places()[0]),
            target=_pose(self._places()[1], [self.norm * a for a in TURN]),
            size=1 / self.unit,
        )

    def true_pose(self):
        """R_cam_body (3, 3) and t_cam_body (3,), metres: of the numbers in the text. USD's camera looks along -z."""
        camera, target = ([Fraction(x) for x in place] for place in self._places())
        apart = [exact.Long(float((b - a) * Fraction(self.unit))) for a, b in zip(camera, target, strict=True)]
        turn = np.diag([1, -1, -1]).astype(exact.Long)
        return turn @ exact.rotation(TURN), turn @ np.array(apart)

    def meant_place(self):
        """t_cam_body as it was meant, before anything was added or rounded."""
        return np.diag([1, -1, -1]) @ (np.array(TARGET_AT) - CAMERA_AT)

    def _places(self):
        return [self._units(np.array(place) + self.aside) for place in (CAMERA_AT, TARGET_AT)]

    def _units(self, metres):
        return tuple(float(x) / self.unit for x in metres)

    def __str__(self) -> str:
        return self.name


def _pose(place, turn=(1.0, 0.0, 0.0, 0.0)) -> str:
    numbers = [", ".join(repr(float(x)) for x in row) for row in (place, turn)]
    return (
        f"double3 xformOp:translate = ({numbers[0]})\n        quatd xformOp:orient = ({numbers[1]})\n"
        '        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]'
    )


FAR = (ASTRONOMICAL_UNIT, -0.3 * ASTRONOMICAL_UNIT, 0.7 * ASTRONOMICAL_UNIT)
STAGES = (
    StageCase(name="at the origin"),
    StageCase(name="at the origin, in centimetres", unit=0.01),
    StageCase(name="in a low orbit, each by itself", aside=(7e6, -3e5, 120.0)),
    StageCase(name="1.5e11 m away, each by itself", aside=FAR),
    StageCase(name="1.5e11 m away, each by itself, in centimetres", aside=FAR, unit=0.01),
    StageCase(name="1.5e11 m away with what holds both", world=FAR),
    StageCase(name="1.5e11 m away with what holds both, in millimetres", world=FAR, unit=0.001),
    StageCase(name="norm off by 1e-6", norm=1 + 0.999e-6),
    StageCase(name="negated", norm=-1.0),
)


def angle(R, true):
    """Radians between two rotations."""
    return float(np.linalg.norm((R - true).astype(float)) / np.sqrt(2))


def place_bound(case):
    """Metres: a double's half step at the numbers in the text is lost in none of them, for their difference is exact;
    what follows is of the size of that difference. A turn that is off moves the target's parts, not its place."""
    away = float(np.linalg.norm(case.true_pose()[1].astype(float)))
    return 16 * 2.0**-53 * away


def angle_bound(case):
    """Radians. USD reads a quaternion of norm 1 + e as the turn of 1 + 2e times the vector from the unturned to the
    turned point: 2e times the sine of its angle."""
    return 16 * 2.0**-53 + 2 * abs(abs(case.norm) - 1) * (1 + 1e-5)


def rounding_of_the_text(case):
    """Metres: half a step of the doubles that hold each coordinate of each of the two."""
    most = max(abs(x) for place in case._places() for x in place) * case.unit
    return 2 * np.sqrt(3) * 2.0**-53 * 2 * most
