"""One picture made again from its provenance, and compared."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

from spin_usd.dataset.process.child import Child
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.errors import InputError
from spin_usd.scene.model import NOMINAL


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One file of the picture: its digest as recorded, as it lies in the dataset (None: missing), and as made again."""

    kind: str
    path: str
    recorded: str
    found: str | None
    again: str

    @property
    def same(self) -> bool:
        return self.recorded == self.found == self.again


def reproduce(dataset: Path, frame: str, *, variant: str = NOMINAL) -> tuple[list[Comparison], dict[str, list[str]]]:
    """Make the picture again in a child process; returns a comparison per file, and what was made with other versions
    (name: [recorded, now])."""
    store = Store(root=dataset.absolute())
    store.refuse_strange()
    path = store.record(variant, frame)
    if path not in (records := list(store.records())):
        known = [each.stem for each in records if each.parent == path.parent][:3]
        hint = f"pictures are named like {', '.join(known)}" if known else "render it first"
        raise InputError(f"has no picture {frame!r} in variant {variant!r}", where=dataset, do=hint)
    record = read_json(path, "record-1")
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder, Child(scratch=Path(folder)) as child:
        answer = child.call("reproduce", dataset=str(store.root), record=record, folder=folder)
    return [Comparison(**comparison) for comparison in answer["files"]], answer["versions"]
