"""The manifest of a dataset's shards: the stage, how pictures are made, and which picture is of which shard.

It lies beside dataset.json until a merge, or a run without a shard, finds all pictures made. A shard leaves it there:
others' pictures may be an earlier run's, made with other options. Shards that write one folder must have the same while
it is there, whether others run or not; who merges folders learns from it which pictures are still to come, and of which
shard.
"""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.files.changes import remove_file
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.nesting import finite_json
from spin_usd.planning.shard import Shard
from spin_usd.store.atomic import write_json
from spin_usd.store.dataset_folder import Store
from spin_usd.store.file_digests import sums
from spin_usd.store.names import SHARDS, record_of

SHARED = "manifest-shared"  # in the work folder of a shard that is being made: the manifest is its own too
WORDS = {
    "count": "in another number of shards",
    "stage": "of another stage",
    "settings": "with other options ({})",
    "shards": "of other frames or variants, or by another version of spin_usd",
}
FINISH = f"give what was given then, or render once without --shard, or remove {SHARDS} to partition it anew"


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """count: how many shards there are · stage: a digest of the stage's files · settings: how pictures are made, and
    the kinds of file · shards: the number of each picture's shard, by variant and frame."""

    count: int
    stage: str
    settings: Mapping[str, Any]
    shards: Mapping[str, Mapping[str, int]]

    def pictures(self) -> Iterator[tuple[tuple[str, str], Shard]]:
        """Yield the variant and frame of every picture, with its shard."""
        for variant, frames in self.shards.items():
            for frame, number in frames.items():
                yield (variant, frame), Shard(number=number, count=self.count)


def refuse_other_shards(store: Store, manifest: Manifest, *, replaced: bool) -> None:
    """Raise InputError where the folder has the manifest of other shards, which would be mixed with these: of some that
    are being made, or of earlier ones, unless their pictures are to be `replaced`. Writes nothing."""
    before = read_manifest(store)
    if before == manifest:
        return
    if any((other / SHARED).exists() for other in store.shards_at_work()):
        do = "wait until those shards have ended, or choose another folder"
        raise InputError(f"is being made {_difference(before, manifest)}", where=store.root, do=do)
    if before and not replaced:
        found = f"was made {_difference(before, manifest)}, as {SHARDS} says"
        raise InputError(found, where=store.root, do=FINISH)


def share_manifest(store: Store, manifest: Manifest, *, work: Path) -> None:
    """Write the manifest, in the dataset's turn, unless it is there. Raises InputError and OutputError as
    `write_manifest` does. `work`: the shard's folder of temporary files."""
    if read_manifest(store) != manifest:
        write_manifest(store, manifest, work=work)
    (work / SHARED).touch()


def write_manifest(store: Store, manifest: Manifest, *, work: Path) -> None:
    """Write the manifest. Raises InputError in place of a file that is not one, and OutputError."""
    if store.folder.type_of(SHARDS) is not None and read_manifest(store) is None:
        raise InputError(
            "is not the manifest of shards", where=store.root / SHARDS, do="move it elsewhere, or remove it"
        )
    write_json(store.folder, SHARDS, asdict(manifest), work=work)


def read_manifest(store: Store) -> Manifest | None:
    """Read the manifest; None where there is none, or something else in its place."""
    with suppress(InputError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        value = finite_json(store.folder.read(SHARDS, MAX_DOCUMENT))
        shards = {str(v): {str(f): int(n) for f, n in frames.items()} for v, frames in value["shards"].items()}
        settings = dict(value["settings"])
        return Manifest(count=int(value["count"]), stage=str(value["stage"]), settings=settings, shards=shards)
    return None


def remove_finished_manifest(store: Store) -> None:
    """Remove the manifest where all its pictures are made, or it is of another stage than the folder's: nobody needs it
    any more, and a dataset is the same however it was made. Raises OutputError."""
    manifest, made = read_manifest(store), set(store.records())
    if manifest is None:
        return
    finished = all(record_of(*picture) in made for picture, _ in manifest.pictures())
    if finished or manifest.stage != digest_of(store.stage):
        remove_file(store.folder, SHARDS)


def digest_of(stage: Path) -> str:
    """Return a digest of the files in the folder of a stage."""
    return sha256(sums(stage).encode("utf-8", errors="surrogateescape")).hexdigest()


def _difference(before: Manifest | None, now: Manifest) -> str:
    """Say in what the shards that the folder has differ from this one."""
    for name, words in WORDS.items():
        if before and getattr(before, name) != getattr(now, name):
            return words.format(", ".join(_other_settings(before, now)))
    return "otherwise"


def _other_settings(before: Manifest, now: Manifest) -> list[str]:
    return [name for name, value in now.settings.items() if before.settings.get(name) != value]
