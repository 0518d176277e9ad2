"""Specifications of augmentations: TOML, valid by schemas/augment-1.schema.json."""

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from spin_usd.basics.resources import bundled
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.checked_document import check_document, read_as
from spin_usd.formats.text_file import tables_in
from spin_usd.scene.scene import NOMINAL
from spin_usd.specifications.sample_table import SampleEntry, samples_of

SCHEMA = "augment-1"
IN_TURN = "in_turn"
RESERVED = {NOMINAL: "the stage without augmentation", "all": "every variant together"}  # names that --variants uses
LONGEST_NAME = 100  # it names files too, beside a suffix


@dataclass(frozen=True, kw_only=True)
class AugmentationEntry:
    """One augmentation: a name of its own, the variants it selects (set -> variant), the parameters that it samples."""

    name: str
    select: Mapping[str, str] = field(default_factory=dict)
    sample: tuple[SampleEntry, ...] = ()
    constraints: Mapping[str, float] = field(default_factory=dict)


SetName = Annotated[str, Meta(pattern="^[A-Za-z_][A-Za-z0-9_]*$")]
Names = Annotated[tuple[SetName, ...], Meta(min_length=1)]


class AugmentationTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Augmentations of one name."""

    name: Annotated[str, Meta(pattern="^[a-z0-9_]+$", description="The variant's name.")]
    count: Annotated[
        Annotated[int, Meta(ge=1, le=1000)] | None,
        Meta(description="Number of copies; they are named NAME_1, NAME_2, ..."),
    ] = None
    select: Annotated[
        dict[str, SetName | Names],
        Meta(description="Variants of the stage's other sets; of a list each augmentation takes the next."),
    ] = {}
    sample: dict[str, Any] = {}
    constraints: dict[str, float] = {}

    @property
    def entries(self) -> Iterator[AugmentationEntry]:
        """Yield the augmentations."""
        names = [self.name] if self.count is None else [f"{self.name}_{i + 1}" for i in range(self.count)]
        return map(self._entry, names, range(len(names)))

    def _entry(self, name: str, turn: int) -> AugmentationEntry:
        """Return the augmentation `name` with entry `turn`, counted from 0, of each list."""
        sample = {
            parameter: _fixed(words, turn) if words["distribution"] == IN_TURN else words
            for parameter, words in self.sample.items()
        }
        return AugmentationEntry(
            name=name,
            select={of: each if isinstance(each, str) else each[turn % len(each)] for of, each in self.select.items()},
            sample=samples_of(sample),
            constraints=self.constraints,
        )


class AugmentationTables(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Augmentations of a stage: each is a variant, which selects among others and samples values of its own."""

    schema: Literal["augment-1"]
    seed: Annotated[int, Meta(description="Seed of all samples; 0 unless given.")] = 0
    augmentation: Annotated[tuple[AugmentationTable, ...], Meta(min_length=1)]


@dataclass(frozen=True, kw_only=True)
class Specification:
    """A specification that was read."""

    name: str
    """The file's stem."""
    sha256: str
    """SHA-256 of the file's bytes."""
    seed: int
    augmentations: tuple[AugmentationEntry, ...]
    """Each entry, repeated `count` times."""


def spec_path(given: str | Path) -> Path:
    """Return the file of the specification of that name, or the file itself. Raises InputError that lists the names."""
    if Path(given).suffix.lower() == ".toml":
        return Path(given)
    return bundled("specification", str(given))


def read_augmentation_spec(path: str | Path) -> Specification:
    """Read the specification in the file at `path`. Raises InputError that names the wrong key."""
    path = Path(path)
    data = read_bytes(path, MAX_SPECIFICATION)
    document = tables_in(data, path)
    check_document(document, SCHEMA, path)
    tables = read_as(AugmentationTables, document, path)
    entries = tuple(entry for table in tables.augmentation for entry in table.entries)
    names = [entry.name for entry in entries]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two augmentations are named {name!r}", where=path, do="rename one")
        if name in RESERVED:
            raise InputError(f"{name!r} is the name of {RESERVED[name]}", where=path, do="choose another")
        if len(name) > LONGEST_NAME:
            found = f"an augmentation's name has {len(name)} characters: {name[:20]}..."
            raise InputError(found, where=path, do=f"take {LONGEST_NAME} at most")
    return Specification(
        name=path.stem,
        sha256=hashlib.sha256(data).hexdigest(),
        seed=tables.seed,
        augmentations=entries,
    )


def _fixed(words: Mapping[str, Any], turn: int) -> dict[str, Any]:
    """Return the keys of a value taken in turn, as keys of a fixed value."""
    rest = {key: value for key, value in words.items() if key != "values"}
    return {**rest, "distribution": "fixed", "value": words["values"][turn % len(words["values"])]}
