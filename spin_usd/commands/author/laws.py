"""The tables of a sampling specification as the laws that they name. All are valid by its schema."""

from collections.abc import Mapping, Sequence
from math import inf, radians
from typing import Any

import numpy as np

from spin_usd.errors import InputError
from spin_usd.sampling.distribution import Distribution, Uniform
from spin_usd.sampling.poses import Inside, OffsetLaw, PlaceLaw, PoseLaw, PositionLaw, ShareLaw
from spin_usd.sampling.relative_motion import Approach, FreeFall, RelativeOrbit
from spin_usd.sampling.sample import distribution_of
from spin_usd.sampling.trajectory import Chaser, TrajectoryLaw, Transfer
from spin_usd.sampling.turning import Spin, Tumble

UNIT = "unit"  # of a distribution's numbers, for readers
ANYWHERE = Uniform(low=0, high=1)
Frame = tuple[int, int]


def pose_law(table: Mapping[str, Any], frame: Frame | None, where: str) -> PoseLaw:
    """Return the law of a table `poses`. frame: width and height of the pictures in whose pixels offsets are.

    Raises InputError that says `where`, for a distribution without a possible value.
    """
    return PoseLaw(
        position=_position(table, frame, where),
        attitude=_distribution(table["attitude"], f"{where}, attitude"),
        inside=_inside(table, where),
    )


def trajectory_law(table: Mapping[str, Any], frame: Frame | None, where: str) -> TrajectoryLaw:
    """Return the law of a table `trajectory`; arguments and errors are those of pose_law."""
    pitch, yaw = table.get("tilt_deg", (0.0, 0.0))
    least, most = table.get("range_m", (0.0, inf))
    return TrajectoryLaw(
        path=_path(table, frame, where),
        spin=_turning(table, where),
        attitude=_distribution(table["attitude"], f"{where}, attitude"),
        step=table["step_s"],
        period=table.get("period_s", inf),
        tilt=(radians(pitch), radians(yaw)),
        centre_of_mass=_vector(table.get("centre_of_mass_m", (0.0, 0.0, 0.0))),
        range=(least, most),
        inside=_inside(table, where),
        sun=_distribution(table["sun"], f"{where}, sun") if "sun" in table else None,
    )


def _position(table: Mapping[str, Any], frame: Frame | None, where: str) -> PositionLaw:
    return PositionLaw(
        range=_distribution(table["range"], f"{where}, range"),
        place=_place(table, frame, where),
    )


def _place(table: Mapping[str, Any], frame: Frame | None, where: str) -> PlaceLaw:
    offsets, shares = ("across", "down"), ("u_share", "v_share")
    given = {name: _distribution(table[name], f"{where}, {name}") for name in offsets + shares if name in table}
    if "across" not in given:
        return ShareLaw(u=given.get("u_share", ANYWHERE), v=given.get("v_share", ANYWHERE))
    if "u_share" in given or "v_share" in given:
        do = "give one of the two"
        raise InputError("gives a place both in pixels (across) and in shares (u_share, v_share)", where=where, do=do)
    if frame is None:
        do = "name the camera whose pixels these are, or give u_share and v_share"
        raise InputError("gives across and down, and no camera", where=where, do=do)
    return OffsetLaw(across=given["across"], down=given["down"], frame=frame)


def _inside(table: Mapping[str, Any], where: str) -> Inside | None:
    if "inside" not in table:
        return None
    given = table["inside"]
    least, most = given if isinstance(given, Sequence) else (given, 1.0)
    if least > most:
        raise InputError(f"inside is from {least:g} to {most:g}", where=where, do="give the lower share first")
    return Inside(least=least, most=most)


def _path(table: Mapping[str, Any], frame: Frame | None, where: str) -> RelativeOrbit | Transfer | Chaser:
    if "chaser" in table:
        return _chaser(table["chaser"])
    if "orbit" in table:
        return _orbit(table["orbit"])
    start, end = (_position(table[name], frame, f"{where}, {name}") for name in ("start", "end"))
    return Transfer(start=start, end=end)


def _chaser(table: Mapping[str, Any]) -> Chaser:
    if "orbit" in table:
        return Chaser(motion=_orbit(table["orbit"]))
    if "approach" in table:
        ends = table["approach"]
        return Chaser(motion=Approach(start=_vector(ends["start_m"]), end=_vector(ends["end_m"])))
    state = table["free_fall"]
    return Chaser(motion=FreeFall(place=_vector(state["place_m"]), velocity=_vector(state["velocity_m_s"])))


def _orbit(orbit: Mapping[str, Any]) -> RelativeOrbit:
    return RelativeOrbit(
        forward=orbit["forward_m"],
        up=orbit.get("up_m", 0.0),
        eccentric=orbit.get("eccentric_m", 0.0),
        phase=radians(orbit.get("phase_deg", 0.0)),
        inclined=orbit.get("inclined_m", 0.0),
        inclined_phase=radians(orbit.get("inclined_phase_deg", 0.0)),
    )


def _turning(table: Mapping[str, Any], where: str) -> Spin | Tumble:
    if "spin" in table and "tumble" in table:
        raise InputError("has both spin and tumble", where=where, do="keep one of them")
    return _spin(table["spin"], f"{where}, spin") if "spin" in table else _tumble(table["tumble"], f"{where}, tumble")


def _spin(table: Mapping[str, Any], where: str) -> Spin:
    return Spin(
        degrees=_distribution(table["degrees"], f"{where}, degrees"),
        axis=_distribution(table["axis"], f"{where}, axis"),
        symmetry=_vector(table.get("symmetry", (0.0, 0.0, 1.0))),
        inertia=table.get("inertia", 1.0),
    )


def _tumble(table: Mapping[str, Any], where: str) -> Tumble:
    given = np.array(table["inertia_kg_m2"], np.float64)
    tensor = np.diag(given) if given.ndim == 1 else given
    _check_inertia(tensor, f"{where}, inertia_kg_m2")
    return Tumble(
        rate=_distribution(table["rate_deg_s"], f"{where}, rate_deg_s"),
        axis=_distribution(table["axis"], f"{where}, axis"),
        inertia=tuple(_vector(row) for row in tensor.tolist()),
    )


def _check_inertia(tensor: np.ndarray, where: str) -> None:
    """Raise InputError for a tensor (3, 3) that no body has: each of its principal moments is positive, and at most
    the sum of the other two."""
    if not np.array_equal(tensor, tensor.T):
        raise InputError("is not symmetric", where=where, do="give a tensor of inertia, or its diagonal")
    moments = np.linalg.eigvalsh(tensor)
    if not (moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9)):
        found = f"has the principal moments {', '.join(f'{moment:g}' for moment in moments)}, which no body has"
        raise InputError(found, where=where, do="make them positive, and none larger than the sum of the others")


def _vector(numbers: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = numbers
    return float(x), float(y), float(z)


def _distribution(table: Mapping[str, Any], where: str) -> Distribution:
    words = {name: value for name, value in table.items() if name != UNIT}
    try:
        return distribution_of(words)
    except InputError as error:
        raise InputError(error.found, where=where, do=error.do) from None
