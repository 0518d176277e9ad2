"""One picture made again from its provenance, and compared."""

import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from spin_usd.commands.reproduce.options import ReproduceOptions
from spin_usd.options import takes
from spin_usd.picture.kinds import RENDERED
from spin_usd.processes.ask_child import ask_child
from spin_usd.processes.child_limits import RENDER_PATIENCE_S, rendering_memory
from spin_usd.processes.devices import refuse_unknown_device, require_device
from spin_usd.processes.open_renderer import require_renderer
from spin_usd.scene.effort import CPU
from spin_usd.scene.model import NOMINAL
from spin_usd.store.dataset import Dataset
from spin_usd.store.dataset_folder import Store
from spin_usd.store.json_schema import read_json
from spin_usd.store.names import record_of
from spin_usd.store.recorded_settings import recorded_settings


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


@dataclass(frozen=True, kw_only=True)
class Reproduction:
    """A picture made again. files: a comparison of each · versions: the libraries that are another version now, by
    name, with the recorded version and today's, "" where there is none · devices: what rendered the light, as recorded
    and now."""

    files: tuple[Comparison, ...]
    versions: Mapping[str, tuple[str, str]]
    devices: tuple[str, str]

    @property
    def same(self) -> bool:
        """Return whether every file came out with the same bytes."""
        return all(file.same for file in self.files)

    def as_json(self) -> dict[str, Any]:
        files = [{**asdict(file), "same": file.same} for file in self.files]
        return {"files": files, "versions": self.versions, "devices": self.devices}


@takes(ReproduceOptions)
def reproduce(options: ReproduceOptions) -> Reproduction:
    """Make one picture again from its provenance and compare it with the one there.

    Raises InputError where the dataset has no such picture, UnsupportedError where this machine has no such device.
    """
    dataset = Path(options.dataset)
    return reproduce_picture(dataset, options.frame, variant=options.variant, device=options.device)


def reproduce_picture(dataset: Path, frame: str, *, variant: str = NOMINAL, device: str | None = None) -> Reproduction:
    """Make the picture again in a child process, its light on the `device`, the recorded one if not given. Raises
    InputError where the dataset has no such picture, UnsupportedError where this machine has no such device."""
    if device is not None:
        refuse_unknown_device(device)
    store = Store(root=dataset.absolute())
    store.refuse_special_files()
    Dataset(dataset).require(frame, variant)
    record = read_json(store.folder, record_of(variant, frame), "record-1")
    recorded = recorded_settings(record)
    device = device or recorded.device
    if RENDERED & record["files"].keys():
        require_renderer(recorded.renderer)
        require_device(device)
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        answer = ask_child(
            "reproduce",
            reads=store.root,
            memory=rendering_memory(graphics=device != CPU),
            within_s=RENDER_PATIENCE_S,
            dataset=str(store.root),
            record=record,
            folder=folder,
            device=device,
        )
    return Reproduction(
        files=tuple(Comparison(**comparison) for comparison in answer["files"]),
        versions={name: (before, now) for name, (before, now) in answer["versions"].items()},
        devices=(recorded.device, device),
    )
