"""Two datasets compared file by file, and one with its own records."""

import json
from collections.abc import Iterator
from pathlib import Path

from spin_usd.sha256 import sha256_of

TIMINGS = "cache/measured.json"  # what a run took: no two runs take the same


def digests(dataset: Path) -> dict[str, str]:
    """Return the sha256 of every file by its name, but of timings; temporary files and locks are files too."""
    files = (path for path in dataset.rglob("*") if path.is_file())
    named = ((path.relative_to(dataset).as_posix(), path) for path in files)
    return {name: sha256_of(path) for name, path in named if name != TIMINGS}


def faults(dataset: Path, whole: dict[str, str], *, pictures: int) -> Iterator[str]:
    """Yield what is wrong with a dataset that should hold the files with the digests `whole`."""
    found = digests(dataset)
    yield from (f"{dataset.name}: {name} is missing" for name in sorted(whole.keys() - found.keys()))
    yield from (f"{dataset.name}: {name} is left" for name in sorted(found.keys() - whole.keys()))
    yield from (f"{dataset.name}: {n} has other bytes" for n in sorted(whole.keys() & found) if whole[n] != found[n])
    yield from (f"{dataset.name}: {path.name} is left" for path in dataset.iterdir() if path.name.startswith("."))
    yield from torn(dataset)
    made = sum(1 for _ in (dataset / "records").glob("*/*.json"))
    if made != pictures:
        yield f"{dataset.name}: {made} of {pictures} pictures"


def torn(dataset: Path) -> Iterator[str]:
    """Yield which files are not as the records say that there are."""
    for path in (dataset / "records").glob("*/*.json"):
        for entry in json.loads(path.read_text())["files"].values():
            file = dataset / entry["path"]
            if not file.is_file() or sha256_of(file) != entry["sha256"]:
                yield f"{dataset.name}: {entry['path']} is not as its record says"
