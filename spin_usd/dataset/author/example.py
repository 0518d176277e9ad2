"""Examples: what an example file says, as laws to sample from."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, radians
from pathlib import Path
from typing import Any

from spin_usd.dataset.author.camera import open_camera
from spin_usd.errors import InputError
from spin_usd.formats.example_file import read_example_file
from spin_usd.formats.spec_file import SampleEntry, check_document, samples_of
from spin_usd.resources import bundled
from spin_usd.sampling.distribution import Distribution
from spin_usd.sampling.poses import PoseLaw, PositionLaw
from spin_usd.sampling.sample import distribution_of
from spin_usd.sampling.trajectory import RelativeOrbit, Spin, TrajectoryLaw, Transfer
from spin_usd.stage.author.camera_layer import lens_of

SCHEMA = "example-1"
UNIT = "unit"  # of a distribution's numbers, for readers
SEQUENCE = "sequence"


@dataclass(frozen=True, kw_only=True, eq=False)
class ExamplePart:
    """A part of an example's pictures: `sequences` of `pictures` each, named by the format `names`, numbered from
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
class Example:
    """camera, target, preset, lights, environment: names of what travels with spin_usd, None for the usual; a preset
    may be a layer's path · constraints: on what is sampled, degrees, by their names in `sampling.constraints` ·
    published: the set's own statistics, as the file has them."""

    file: Path
    title: str
    camera: str
    target: str
    preset: str | None
    lights: str | None
    environment: str | None
    notes: tuple[str, ...]
    constraints: Mapping[str, float]
    parts: tuple[ExamplePart, ...]
    published: Mapping[str, Any]

    @property
    def count(self) -> int:
        return sum(part.count for part in self.parts)


def open_example(given: str | Path) -> Example:
    """Open the example of that name or in that file. Raises InputError that names the file and the place in it."""
    file = Path(given) if Path(given).suffix.lower() == ".toml" else bundled("example", str(given))
    tables = read_example_file(file)
    check_document(tables, SCHEMA, file)
    names = [part["name"] for part in tables["part"]]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"has two parts named {twice!r}", where=file, do="give each its own name")
    shared = tables.get("sample", {})
    lens = lens_of(open_camera(tables["camera"])[0])
    frame = (lens.width, lens.height)
    return Example(
        file=file,
        title=tables["title"],
        camera=tables["camera"],
        target=tables["target"],
        preset=_beside(tables.get("preset"), file),
        lights=tables.get("lights"),
        environment=tables.get("environment"),
        notes=tuple(tables.get("notes", ())),
        constraints=tables.get("constraints", {}),
        parts=tuple(_part(table, shared, frame, f"{file}, part {table['name']!r}") for table in tables["part"]),
        published=tables.get("published", {}),
    )


def _beside(preset: str | None, file: Path) -> str | None:
    """Return a preset's name as it is; that of a layer as its path beside the example's `file`."""
    return str(file.parent / preset) if preset is not None and Path(preset).suffix else preset


def _part(table: Mapping[str, Any], shared: Mapping[str, Any], frame: tuple[int, int], where: str) -> ExamplePart:
    """Read a part. frame: width and height of the example's own pictures."""
    sample = {**shared, **table.get("sample", {})}
    sequential = frozenset(name for name, words in sample.items() if words.get("per") == SEQUENCE)
    return ExamplePart(
        name=table["name"],
        names=table["names"],
        law=_poses(table["poses"], frame, where)
        if "poses" in table
        else _trajectory(table["trajectory"], frame, where),
        pictures=table["pictures"],
        sequences=table.get("sequences", 1),
        first_sequence=table.get("first_sequence", 1),
        first_picture=table.get("first_picture", 1),
        sample=tuple(replace(e, per_frame=e.per_frame or e.parameter in sequential) for e in samples_of(sample)),
        sequential=sequential,
        published=table.get("published", {}),
    )


def _poses(table: Mapping[str, Any], frame: tuple[int, int], where: str) -> PoseLaw:
    attitude = _distribution(table["attitude"], f"{where}, attitude")
    return PoseLaw(place=_place(table, frame, where), attitude=attitude, whole=table.get("whole", False))


def _place(table: Mapping[str, Any], frame: tuple[int, int], where: str) -> PositionLaw:
    laws = {name: _distribution(table[name], f"{where}, {name}") for name in ("range", "across", "down")}
    return PositionLaw(**laws, frame=frame)


def _trajectory(table: Mapping[str, Any], frame: tuple[int, int], where: str) -> TrajectoryLaw:
    pitch, yaw = table.get("tilt_deg", (0.0, 0.0))
    x, y, z = table.get("centre_of_mass_m", (0.0, 0.0, 0.0))
    least, most = table.get("range_m", (0.0, inf))
    return TrajectoryLaw(
        path=_path(table, frame, where),
        spin=_spin(table["spin"], f"{where}, spin"),
        attitude=_distribution(table["attitude"], f"{where}, attitude"),
        step=table["step_s"],
        period=table.get("period_s", inf),
        tilt=(radians(pitch), radians(yaw)),
        centre_of_mass=(x, y, z),
        range=(least, most),
        whole=table.get("whole", False),
    )


def _path(table: Mapping[str, Any], frame: tuple[int, int], where: str) -> RelativeOrbit | Transfer:
    if "orbit" not in table:
        start, end = (_place(table[name], frame, f"{where}, {name}") for name in ("start", "end"))
        return Transfer(start=start, end=end)
    orbit = table["orbit"]
    return RelativeOrbit(
        forward=orbit["forward_m"],
        up=orbit.get("up_m", 0.0),
        eccentric=orbit.get("eccentric_m", 0.0),
        phase=radians(orbit.get("phase_deg", 0.0)),
        inclined=orbit.get("inclined_m", 0.0),
        inclined_phase=radians(orbit.get("inclined_phase_deg", 0.0)),
    )


def _spin(table: Mapping[str, Any], where: str) -> Spin:
    x, y, z = table.get("symmetry", (0.0, 0.0, 1.0))
    return Spin(
        degrees=_distribution(table["degrees"], f"{where}, degrees"),
        axis=_distribution(table["axis"], f"{where}, axis"),
        symmetry=(x, y, z),
        inertia=table.get("inertia", 1.0),
    )


def _distribution(table: Mapping[str, Any], where: str) -> Distribution:
    """Read a distribution. Raises InputError that says `where`, for one without a possible value."""
    words = {name: value for name, value in table.items() if name != UNIT}
    try:
        return distribution_of(words)
    except InputError as error:
        raise InputError(error.found, where=where, do=error.do) from None
