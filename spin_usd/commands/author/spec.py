"""Sampling specifications: what a file, a published set's likeness or a line of text says, as laws to sample from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, radians
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.errors import InputError
from spin_usd.formats.sampling_text import is_sampling_text, read_sampling_file, sampling_document
from spin_usd.formats.spec_file import SampleEntry, check_document, samples_of
from spin_usd.resources import bundled
from spin_usd.sampling.distribution import Distribution, Uniform
from spin_usd.sampling.poses import Inside, OffsetLaw, PlaceLaw, PoseLaw, PositionLaw, ShareLaw
from spin_usd.sampling.relative_motion import Approach, FreeFall, RelativeOrbit
from spin_usd.sampling.sample import distribution_of
from spin_usd.sampling.trajectory import Chaser, TrajectoryLaw, Transfer
from spin_usd.sampling.turning import Spin, Tumble
from spin_usd.stage.author.camera_layer import lens_of, open_camera_layer

SCHEMA = "sample-1"
SEQUENCE = "sequence"
UNIT = "unit"  # of a distribution's numbers, for readers
ANYWHERE = Uniform(low=0, high=1)
Frame = tuple[int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class SamplingPart:
    """A part of the pictures: `sequences` of `pictures` each, named by the format `names`, numbered from
    `first_sequence` and `first_picture` · sequential: those of `sample` that are sampled for each sequence, which are
    per frame otherwise · published: the part's own statistics, as the file has them."""

    name: str
    names: str
    law: PoseLaw | TrajectoryLaw
    pictures: int
    sequences: int
    first_sequence: int
    first_picture: int
    sample: tuple[SampleEntry, ...]
    sequential: frozenset[str]
    published: Mapping[str, Any]

    @property
    def count(self) -> int:
        return self.sequences * self.pictures


@dataclass(frozen=True, kw_only=True)
class SamplingSpec:
    """file: None for a line of text · source: what messages call it · camera, target: names of what travels with
    spin_usd, None where the user is to choose · preset, lights, environment: such names, None for the usual; a preset
    may be a layer's path · constraints: on what is sampled, degrees, by their names in `sampling.constraints` ·
    published: the set's own statistics, as the file has them."""

    file: Path | None
    source: str
    title: str
    camera: str | None
    target: str | None
    preset: str | None
    lights: str | None
    environment: str | None
    notes: tuple[str, ...]
    constraints: Mapping[str, float]
    parts: tuple[SamplingPart, ...]
    published: Mapping[str, Any]

    @property
    def count(self) -> int:
        return sum(part.count for part in self.parts)


def open_spec(given: str | Path, count: int | None = None) -> SamplingSpec:
    """Open the specification of that name, in that file, or of which `given` is the text; `count` pictures of a text
    that does not say how many. Raises InputError that names the file and the place in it."""
    if is_sampling_text(str(given)):
        return _spec(sampling_document(str(given), count), None, "sample")
    file = Path(given) if Path(given).suffix.lower() == ".toml" else bundled("sample", str(given))
    return _spec(read_sampling_file(file), file, str(file))


def _spec(tables: Mapping[str, Any], file: Path | None, source: str) -> SamplingSpec:
    """Return the specification of these tables. Raises InputError."""
    check_document(tables, SCHEMA, source)
    names = [part["name"] for part in tables["part"]]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"has two parts named {twice!r}", where=source, do="give each its own name")
    shared, frame = tables.get("sample", {}), _frame(tables.get("camera"))
    return SamplingSpec(
        file=file,
        source=source,
        title=tables.get("title", ""),
        camera=tables.get("camera"),
        target=tables.get("target"),
        preset=_beside(tables.get("preset"), file),
        lights=tables.get("lights"),
        environment=tables.get("environment"),
        notes=tuple(tables.get("notes", ())),
        constraints=tables.get("constraints", {}),
        parts=tuple(_part(table, shared, frame, f"{source}, part {table['name']!r}") for table in tables["part"]),
        published=tables.get("published", {}),
    )


def _frame(camera: str | None) -> Frame | None:
    """Return width and height of the specification's own pictures, None where it names no camera."""
    if camera is None:
        return None
    lens = lens_of(open_camera_layer(bundled("camera", camera)))
    return lens.width, lens.height


def _beside(preset: str | None, file: Path | None) -> str | None:
    """Return a preset's name as it is; that of a layer as its path beside the specification's `file`."""
    layer = preset is not None and file is not None and bool(Path(preset).suffix)
    return str(file.parent / preset) if layer and file and preset else preset


def _part(table: Mapping[str, Any], shared: Mapping[str, Any], frame: Frame | None, where: str) -> SamplingPart:
    sample = {**shared, **table.get("sample", {})}
    sequential = frozenset(name for name, words in sample.items() if words.get("per") == SEQUENCE)
    poses = table.get("poses")
    return SamplingPart(
        name=table["name"],
        names=table["names"],
        law=trajectory_law(table["trajectory"], frame, where) if poses is None else pose_law(poses, frame, where),
        pictures=table["pictures"],
        sequences=table.get("sequences", 1),
        first_sequence=table.get("first_sequence", 1),
        first_picture=table.get("first_picture", 1),
        sample=tuple(replace(e, per_frame=e.per_frame or e.parameter in sequential) for e in samples_of(sample)),
        sequential=sequential,
        published=table.get("published", {}),
    )


def pose_law(table: Mapping[str, Any], frame: Frame | None, where: str) -> PoseLaw:
    """Return the law of a table `poses`. frame: width and height of the pictures in whose pixels offsets are.

    Raises InputError that says `where`, for a distribution without a possible value.
    """
    return PoseLaw(
        position=position_law(table, frame, where),
        attitude=_distribution(table["attitude"], f"{where}, attitude"),
        inside=inside_law(table, where),
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
        inside=inside_law(table, where),
        sun=_distribution(table["sun"], f"{where}, sun") if "sun" in table else None,
    )


def position_law(table: Mapping[str, Any], frame: Frame | None, where: str) -> PositionLaw:
    """Return the law of a table's range and place; arguments and errors are those of pose_law."""
    return PositionLaw(
        range=_distribution(table["range"], f"{where}, range"),
        place=place_law(table, frame, where),
    )


def place_law(table: Mapping[str, Any], frame: Frame | None, where: str) -> PlaceLaw:
    """Return the law of a table's place in the picture; arguments and errors are those of pose_law."""
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


def inside_law(table: Mapping[str, Any], where: str) -> Inside | None:
    """Return how much a table wants in the picture. Raises InputError that says `where`."""
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
    start, end = (position_law(table[name], frame, f"{where}, {name}") for name in ("start", "end"))
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
