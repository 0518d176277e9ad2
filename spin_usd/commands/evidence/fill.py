"""A sampling specification whose pictures lie in the holes of a domain: a part for each hole.

The target's origin is at the principal point, where the camera's axis is the line of sight: there the directions of Sun
and attitude are the domain's. Values lie MARGIN away from the limits of a cell, which roundings cannot cross.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.evidence.domain import DirectionCells, Domain, NumberCells
from spin_usd.commands.evidence.report import CellCoverage, Hole
from spin_usd.geometry.rotation import quaternion_from_matrix
from spin_usd.geometry.sphere_cells import SphereCells

MARGIN = 0.05  # of a cell's width, at each end
NEAREST = 1e-3  # metres: of a range whose lowest limit is 0
ROLLS = 16  # attitudes to choose from of a cell of roll
MOST_PARTS = 1000
EXPRESSIBLE = ("range", "sun", "attitude", "roll", "visible")
IN_THE_MIDDLE = ("sun", "attitude", "roll")
HEAD = """# Pictures for the holes of {title}, by spin-usd evidence: author them with the set's own target and camera.
schema = "sample-1"
title = {name}
"""


@dataclass(frozen=True, kw_only=True)
class FillFrame:
    """What the pictures of a specification take from those that there are."""

    ranges: tuple[float, float]
    """Least and greatest range, metres, where the domain names none."""
    principal: tuple[float, float]
    """Principal point, as shares of width and height."""


def fill_of(domain: Domain, coverage: Sequence[CellCoverage], frame: FillFrame) -> tuple[str, list[str]]:
    """Return the text of a specification with the missing pictures of each hole, "" for none, and a sentence on each
    kind of hole that it cannot fill."""
    holes, notes = list[Hole](), list[str]()
    for each in coverage:
        if not each.holes:
            continue
        if lack := _not_filled(each.dimensions):
            notes.append(
                f"{pluralise(len(each.holes), 'hole')} in {' and '.join(each.dimensions)} cannot be filled: {lack}"
            )
        else:
            holes += each.holes
    if len(holes) > MOST_PARTS:
        rest = pluralise(len(holes) - MOST_PARTS, "hole")
        notes.append(f"{rest} left for another specification: one fills {MOST_PARTS} at most")
        holes = holes[:MOST_PARTS]
    head = HEAD.format(title=domain.title.replace("\n", " ") or "a domain", name=json.dumps(f"Holes of {domain.title}"))
    parts = [_part(domain, number, hole, frame) for number, hole in enumerate(holes, 1)]
    return ("\n".join([head, *parts]) if parts else ""), notes


def _not_filled(names: Sequence[str]) -> str:
    if others := [name for name in names if name not in EXPRESSIBLE]:
        return f"a sampling specification does not state {' and '.join(others)}"
    if "visible" in names and set(names) & set(IN_THE_MIDDLE):
        return "a target that is partly outside the picture is not on the camera's axis"
    return ""


def _part(domain: Domain, number: int, hole: Hole, frame: FillFrame) -> str:
    """Return the table of a part; dimensions that the hole leaves open have any value of the domain."""
    part = f"hole_{number:04d}"
    poses: dict[str, Any] = {"range": _range(domain, hole, frame), "attitude": _attitude(domain, hole)}
    if "visible" in hole.cells:
        low, high = _within(domain, "visible", hole.cells["visible"])
        poses["inside"] = [low, 1.0 if hole.bounds["visible"][-1] == 1 else high]
    else:
        places = zip(("u_share", "v_share"), frame.principal, strict=True)
        poses |= {name: {"distribution": "fixed", "value": share} for name, share in places}
    lines = [
        "[[part]]",
        f"name = {json.dumps(part)}",
        f'names = "{part}_{{picture:04d}}"',
        f"pictures = {domain.pictures - hole.pictures}",
        f"poses = {_inline(poses)}",
    ]
    if domain.sun is not None:
        low, high = _within(domain, "sun", hole.cells.get("sun"))
        words = {"distribution": "directions", "axis": [0, 0, -1], "least": low, "most": high, "per": "frame"}
        lines.append(f'sample = {{ "sun.direction" = {_inline(words)} }}')
    return "\n".join(lines) + "\n"


def _within(domain: Domain, name: str, cell: int | None) -> list[float]:
    """Return the limits of a cell, or of the whole dimension, without its margins."""
    bins = getattr(domain, name)
    assert isinstance(bins, NumberCells)
    low, high = (bins.limits[0], bins.limits[-1]) if cell is None else bins.limits[cell : cell + 2]
    margin = MARGIN * (high - low)
    return [low + margin, high - margin]


def _range(domain: Domain, hole: Hole, frame: FillFrame) -> dict[str, Any]:
    named = domain.range is not None
    low, high = _within(domain, "range", hole.cells.get("range")) if named else frame.ranges
    return {"distribution": "uniform", "low": max(low, NEAREST), "high": high}


def _attitude(domain: Domain, hole: Hole) -> dict[str, Any]:
    cell = hole.cells.get("attitude")
    sphere = SphereCells(count=domain.attitude.cells) if isinstance(domain.attitude, DirectionCells) else None
    if "roll" in hole.cells:
        low, high = np.radians(_within(domain, "roll", hole.cells["roll"]))
        middles = _spread(ROLLS) if sphere is None or cell is None else np.tile(sphere.inside(cell)[0], (ROLLS, 1))
        turned = zip(middles, np.linspace(low, high, ROLLS), strict=True)
        return {"distribution": "choice", "values": [_facing(each, roll) for each, roll in turned]}
    if sphere is None or cell is None:
        return {"distribution": "attitudes"}
    middle, within = sphere.inside(cell)
    return {"distribution": "facing", "axis": middle.tolist(), "most": (1 - MARGIN) * within}


def _spread(count: int) -> Float:
    """Return (count, 3) directions that are spread evenly over the sphere, by the golden angle."""
    z, turn = (2 * np.arange(count) + 1) / count - 1, np.pi * (3 - 5**0.5) * np.arange(count)
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], -1)


def _facing(direction: Float, roll: float) -> list[float]:
    """Return q_cam_body by which the body's `direction` (3,) points along -z of the camera, and its z axis `roll`
    radians clockwise from up in the image."""
    if abs(direction[2]) > 1 - 1e-6:  # seen along its z axis, which then has no direction in the image
        direction = np.array([0.01, 0, direction[2]]) / np.linalg.norm([0.01, direction[2]])
    north = np.array([0, 0, 1.0]) - direction[2] * direction
    north /= np.linalg.norm(north)
    up = np.array([np.sin(roll), -np.cos(roll), 0])
    ahead = np.array([0, 0, -1.0])
    R = np.stack([ahead, up, np.cross(ahead, up)], -1) @ np.stack([direction, north, np.cross(direction, north)])
    return [float(value) for value in quaternion_from_matrix(R)]


def _inline(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_inline(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(round(value, 9) if isinstance(value, float) else value)
