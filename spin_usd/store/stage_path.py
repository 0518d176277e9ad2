"""The path of a stage as a user gives it."""

from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.store.names import DESCRIPTION, STAGE

ROOT_LAYER = "dataset.usda"
"""The root layer in a folder that `author` made."""


def root_layer(path: Path) -> Path:
    """Return the root layer that `path` means: in a folder that `author` made, its dataset.usda."""
    inside = path / ROOT_LAYER
    return inside if inside.is_file() else path


def existing_stage(path: Path) -> Path:
    """Return the root layer that `path` means. Raises InputError for a path that is not a stage's."""
    root = root_layer(path)
    if not root.exists():
        raise InputError("does not exist", where=path, do="check the path, or make a stage with spin-usd author")
    if (root / DESCRIPTION).exists():
        raise InputError("is a dataset, and a stage is expected", where=path, do=f"give its stage, {path / STAGE}")
    if root.is_dir():
        raise InputError("is a folder without a dataset.usda", where=path, do="give the stage's root layer")
    return root
