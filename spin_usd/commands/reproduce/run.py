"""One picture made again from its provenance, and compared."""

import tempfile
from pathlib import Path

from spin_usd.commands.reproduce.options import ReproduceOptions
from spin_usd.commands.reproduce.report import REPRODUCE, Reproduce, Reproduction
from spin_usd.options import takes
from spin_usd.picture.kinds import RENDERED
from spin_usd.processes.ask_child import ask_child
from spin_usd.processes.child_limits import RENDER_PATIENCE_S, rendering_memory
from spin_usd.processes.devices import refuse_unknown_device, require_device
from spin_usd.processes.open_renderer import require_renderer
from spin_usd.reading.dataset import Dataset
from spin_usd.scene.effort import CPU
from spin_usd.scene.scene import NOMINAL
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import record_of
from spin_usd.store.read_documents import read_record


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
    record = read_record(store.folder, record_of(variant, frame))
    recorded = record.settings
    device = device or recorded.device
    if RENDERED & record.files.keys():
        require_renderer(recorded.renderer)
        require_device(device)
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        return ask_child(
            REPRODUCE,
            Reproduce(dataset=str(store.root), record=record_of(variant, frame), folder=folder, device=device),
            reads=store.root,
            memory=rendering_memory(graphics=device != CPU),
            within_s=RENDER_PATIENCE_S,
            writes=(Path(folder),) if device == CPU else None,
        )
