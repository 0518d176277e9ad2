"""The stage of one page, to be edited by hand."""

import shutil
from pathlib import Path

from spin_usd.resources import stages
from spin_usd.store.new_folder import new_folder

ROOT = "dataset.usda"


def write_minimal(out: Path) -> Path:
    """Write it into the new folder `out` and return its root layer. Raises InputError when `out` is there and not
    empty, OutputError."""
    with new_folder(out) as folder:
        shutil.copyfile(stages() / "examples" / "minimal.usda", folder / ROOT)
    return out / ROOT
