"""Sampling specifications: what a file, a published set's likeness or a line of text says, as laws to sample from."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from spin_usd.commands.author.laws import Frame, pose_law, trajectory_law
from spin_usd.errors import InputError
from spin_usd.formats.sampling_file import read_sampling_file
from spin_usd.formats.sampling_text import is_sampling_text, sampling_document
from spin_usd.formats.spec_file import SampleEntry, check_document, samples_of
from spin_usd.resources import bundled
from spin_usd.sampling.poses import PoseLaw
from spin_usd.sampling.trajectory import TrajectoryLaw
from spin_usd.stage.author.camera_layer import lens_of, open_camera_layer

SCHEMA = "sample-1"
SEQUENCE = "sequence"


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
