"""The path of a stage as a user gives it."""

from pathlib import Path


def root_layer(path: Path) -> Path:
    """Return the root layer that `path` means: in a folder that `author` made, its dataset.usda."""
    inside = path / "dataset.usda"
    return inside if inside.is_file() else path
