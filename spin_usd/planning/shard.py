"""A shard of a run: one of several parts of its frames, each made by a command of its own, in a folder of its own.

Frames are dealt out in the order of a hash of their names, all variants of a frame together: every shard knows its own
without messages, and plans no more. With its dataset.json lies a manifest of the whole run, from which `merge` and
`check` learn which pictures are missing, and in which shard.
"""

import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from spin_usd.basics.nesting import typed_json
from spin_usd.basics.pluralise import pluralise
from spin_usd.errors import InputError
from spin_usd.files.changes import remove_file
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.store.atomic import write_json
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import SHARDS, picture_of

MAX_SHARDS = 100_000  # more than any scheduler starts, and a slip of the hand is caught
TEXT = re.compile(r"([0-9]{1,6})/([0-9]{1,6})")


@dataclass(frozen=True, kw_only=True)
class Shard:
    """The shard `number`, from 0, of `count`."""

    number: int
    count: int

    @classmethod
    def parse(cls, text: str) -> "Shard":
        """Read "I/N". Raises InputError if it is not a shard."""
        found = TEXT.fullmatch(text.strip())
        number, count = (int(found[1]), int(found[2])) if found else (0, 0)
        if not number < count <= MAX_SHARDS:
            do = f"write I/N: part I, from 0, of a run in N parts, such as 0/3, 1/3 and 2/3; N is {MAX_SHARDS} at most"
            raise InputError(f"there is no shard {text!r}", do=do)
        return cls(number=number, count=count)

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    def own(self, frames: Sequence[str]) -> list[int]:
        """Return the places, in order, of its own among the names of all `frames`."""
        return sorted(_shuffled(frames)[self.number :: self.count])


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """The manifest of a run in `count` shards: the names of the variants and of the frames that are made."""

    count: Annotated[int, Meta(ge=1, le=MAX_SHARDS)]
    variants: tuple[str, ...]
    frames: tuple[str, ...]

    def missing(self, there: Collection[tuple[str, str]]) -> dict[tuple[str, str], Shard]:
        """Return by (frame, variant) the shards of the pictures that are not `there`."""
        shuffled = [self.frames[place] for place in _shuffled(self.frames)]
        shards = {frame: Shard(number=place % self.count, count=self.count) for place, frame in enumerate(shuffled)}
        wanted = ((frame, variant) for variant in self.variants for frame in self.frames)
        return {picture: shards[picture[0]] for picture in wanted if picture not in there}


def _shuffled(frames: Sequence[str]) -> list[int]:
    """Return the places of the frames in the order of a hash of their names: neighbours cost alike, and are parted."""
    return sorted(range(len(frames)), key=lambda place: sha256(frames[place].encode()).digest())


def write_manifest(store: Store, manifest: Manifest, *, work: Path) -> None:
    """Write the manifest. Raises InputError in place of a file that is not one, and OutputError."""
    if store.folder.type_of(SHARDS) is not None and read_manifest(store) is None:
        raise InputError(
            "is not the manifest of shards", where=store.root / SHARDS, do="move it elsewhere, or remove it"
        )
    write_json(store.folder, SHARDS, asdict(manifest), work=work)


def read_manifest(store: Store) -> Manifest | None:
    """Read the manifest; None if there is none, or it is not a manifest."""
    with suppress(InputError, ValueError):
        return typed_json(store.folder.read(SHARDS, MAX_DOCUMENT), Manifest)
    return None


def remove_manifest(store: Store) -> None:
    """Remove the manifest, if there is one. Raises OutputError."""
    if read_manifest(store) is not None:
        remove_file(store.folder, SHARDS)


def missing_pictures(store: Store) -> dict[tuple[str, str], Shard]:
    """Return by (frame, variant) the shards of the pictures that the dataset's manifest, if any, lists as missing."""
    manifest = read_manifest(store)
    return manifest.missing(set(map(picture_of, store.records()))) if manifest else {}


def missing_in_words(count: int, shard: str) -> str:
    """Return a message on how many pictures of the shard, "1/3", are missing."""
    return f"missing: {pluralise(count, 'picture')} of shard {shard}"
