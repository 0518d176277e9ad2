"""Asset paths with backslashes, as exporters on Windows write them and only Windows reads them."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pxr import Sdf, UsdUtils

from spin_usd.stage.composition.files import LAYERS, files_of
from spin_usd.stage.usd.layer_file import layer_at


@contextmanager
def slashes(source: Path) -> Iterator[None]:
    """Within this context, and in memory only, replace backslashes by slashes in asset paths of all layers that
    `source` depends on, where the file exists. Raises StageError as `files_of`, for what they named before and name
    then."""
    changed: list[Sdf.Layer] = []
    while more := [layer for layer in _layers(source) if _fix(layer)]:
        changed += more  # what these name now may name others
    try:
        yield
    finally:
        for layer in changed:
            layer.Reload(force=True)


def _layers(source: Path) -> list[Sdf.Layer]:
    files = (file for file in files_of(source).found if file.suffix.lower() in LAYERS)
    return [layer_at(file) for file in files]


def _fix(layer: Sdf.Layer) -> bool:
    folder, found = Path(layer.realPath).parent, []

    def slashed(path: str) -> str:
        other = path.replace("\\", "/")
        if other == path or (folder / path).exists() or not (folder / other).is_file():
            return path
        found.append(path)
        return other

    UsdUtils.ModifyAssetPaths(layer, slashed)
    return bool(found)
