"""Sampling specifications: a file, a published set's likeness or a line of text, as distributions to sample."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from msgspec import structs

from spin_usd.basics.resources import bundled
from spin_usd.errors import InputError
from spin_usd.formats.checked_document import check_document, read_as
from spin_usd.sampling.poses import PoseLaw
from spin_usd.sampling.trajectory import TrajectoryLaw
from spin_usd.specifications.sample_table import SampleEntry, samples_of
from spin_usd.specifications.sampling_tables import Frame, PartTable, SamplingTables
from spin_usd.specifications.sampling_text import is_sampling_text, read_sampling_file, sampling_document
from spin_usd.stage.author.camera_layer import lens_of, open_camera_layer

SCHEMA = "sample-1"
SEQUENCE = "sequence"


@dataclass(frozen=True, kw_only=True, eq=False)
class SamplingPart:
    """A part of the pictures: sequences of pictures, named and numbered by its table."""

    table: PartTable
    law: PoseLaw | TrajectoryLaw
    sample: tuple[SampleEntry, ...]
    sequential: frozenset[str]
    """Keys of `sample` that are sampled for each sequence; elsewhere they are sampled per frame."""

    @property
    def count(self) -> int:
        return self.table.sequences * self.table.pictures


@dataclass(frozen=True, kw_only=True)
class SamplingSpec:
    """An opened specification."""

    file: Path | None
    """File of the specification; None for a line of text."""
    source: str
    """Name in messages."""
    table: SamplingTables
    parts: tuple[SamplingPart, ...]

    @property
    def count(self) -> int:
        return sum(part.count for part in self.parts)


def open_spec(given: str | Path, count: int | None = None) -> SamplingSpec:
    """Open the specification `given` by name, file or text; a text without a number of pictures has `count`. Raises
    InputError that names the file and the place in it."""
    if is_sampling_text(str(given)):
        return _spec(sampling_document(str(given), count), None, "sample")
    file = Path(given) if Path(given).suffix.lower() == ".toml" else bundled("sample", str(given))
    return _spec(read_sampling_file(file), file, str(file))


def _spec(tables: Mapping[str, Any], file: Path | None, source: str) -> SamplingSpec:
    """Return the specification of these tables. Raises InputError."""
    check_document(tables, SCHEMA, source)
    table = read_as(SamplingTables, tables, source)
    names = [part.name for part in table.part]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"has two parts named {twice!r}", where=source, do="give each its own name")
    frame = _frame(table.camera)
    if table.preset and file and Path(table.preset).suffix:  # a layer beside the file
        table = structs.replace(table, preset=str(file.parent / table.preset))
    parts = tuple(_part(part, table.sample, frame, f"{source}, part {part.name!r}") for part in table.part)
    return SamplingSpec(file=file, source=source, table=table, parts=parts)


def _frame(camera: str | None) -> Frame | None:
    """Return width and height of the specification's own pictures, None if it names no camera."""
    if camera is None:
        return None
    lens = lens_of(open_camera_layer(bundled("camera", camera)))
    return lens.width, lens.height


def _part(table: PartTable, shared: Mapping[str, Any], frame: Frame | None, where: str) -> SamplingPart:
    sample = {**shared, **table.sample}
    sequential = frozenset(name for name, words in sample.items() if words.get("per") == SEQUENCE)
    return SamplingPart(
        table=table,
        law=table.law(frame, where),
        sample=tuple(replace(e, per_frame=e.per_frame or e.parameter in sequential) for e in samples_of(sample)),
        sequential=sequential,
    )
