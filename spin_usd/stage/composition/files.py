"""Find and check the files that a stage is made of, before USD opens any of them.

USD's resolver follows absolute paths, `..`, symbolic links and named pipes without a warning. Here a stage may only
name files by relative paths that stay within its own folder.
"""

import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Sdf

from spin_usd.errors import StageError
from spin_usd.stage.composition.named_assets import named_assets, opened_assets
from spin_usd.stage.usd.image_tiles import UDIM
from spin_usd.stage.usd.parser_faults import parser_faults

LAYERS = (".usd", ".usda", ".usdc")
EXTENSIONS = (*LAYERS, ".usdz")
MAX_FILE_BYTES = 2**31
MAX_FILES = 10_000
MAX_DEPTH = 256  # USD's text parser recurses: 100,000 nested brackets overflow its stack
QUOTED = re.compile(rb'"""(?s:.*?)"""|"[^"\n]*"|#[^\n]*')
SCHEME = re.compile(r"^[A-Za-z][A-Za-z0-9+.-]+:")


@dataclass(frozen=True, kw_only=True)
class Missing:
    """An asset path without a file, and the layer that names it."""

    name: str
    layer: Path

    def __str__(self) -> str:
        return f"@{self.name}@ named by {self.layer}"


@dataclass(frozen=True, kw_only=True)
class Files:
    """All files that a stage depends on, over all variants: `root` first. Paths are real ones.

    `missing`: files that are named but do not exist.
    """

    root: Path
    found: tuple[Path, ...]
    missing: tuple[Missing, ...]


def files_of(path: str | Path) -> Files:
    """Find all files that the layer at `path` depends on.

    Raises StageError for a path that leaves the stage's folder, a file that is not regular or too large, a layer
    that does not parse, or a time scale of zero or less.
    """
    root = Path(path).resolve()
    if root.suffix.lower() not in EXTENSIONS:
        raise StageError("is not a USD stage", where=path, do=f"give a file that ends in {', '.join(EXTENSIONS)}")
    if not root.exists():
        raise StageError("does not exist", where=path, do="check the path, or make a stage with spin-usd author")
    found: dict[Path, None] = {}
    missing: list[Missing] = []
    queue = [root]
    while queue:
        file = queue.pop(0)
        if file in found:
            continue
        if len(found) >= MAX_FILES:
            raise StageError(f"depends on more than {MAX_FILES} files", where=path, do="split the stage")
        _check_file(file)
        found[file] = None
        for named in _named_by(file):
            located = _locate(named, file, root.parent)
            missing += [] if located else [Missing(name=named, layer=file)]
            queue += located
    return Files(root=root, found=tuple(found), missing=tuple(missing))


def udim_files(path: Path) -> list[Path]:
    """Return `path`, or the existing tiles where its name holds <UDIM>."""
    if UDIM not in path.name:
        return [path]
    return sorted(path.parent.glob(path.name.replace(UDIM, "[0-9][0-9][0-9][0-9]")))


def _check_file(file: Path) -> None:
    status = file.lstat()
    if not stat.S_ISREG(status.st_mode):
        raise StageError("is not a regular file", where=file, do="replace it by a file")
    if status.st_size > MAX_FILE_BYTES:
        raise StageError(f"has {status.st_size} bytes, more than {MAX_FILE_BYTES}", where=file, do="split the layer")


def _named_by(file: Path) -> list[str]:
    """List every asset path that a layer opens; none for other files, and for packages, which hold their own files."""
    suffix = file.suffix.lower()
    if suffix not in EXTENSIONS:
        return []
    with parser_faults(file):
        if suffix == ".usdz":
            _check_package(file)
            return []
        _check_depth(file)
        layer = Sdf.Layer.FindOrOpen(str(file))
        if layer.timeCodesPerSecond <= 0:  # USD would list time samples endlessly
            found = f"timeCodesPerSecond is {layer.timeCodesPerSecond:g}"
            raise StageError(found, where=file, do="set it to a positive number, 24 for instance")
        names = named_assets(str(file))
        return names if all((file.parent / name).is_file() for name in names) else opened_assets(str(file), names)


def _check_depth(file: Path) -> None:
    """Raise StageError for text whose brackets nest deeper than MAX_DEPTH."""
    text = file.read_bytes()
    if not text.startswith(b"#usda"):
        return
    if _depth(text) > MAX_DEPTH and _depth(QUOTED.sub(b"", text)) > MAX_DEPTH:
        raise StageError(f"nests brackets deeper than {MAX_DEPTH}", where=file, do="flatten it")


def _depth(text: bytes) -> int:
    codes = np.frombuffer(text, np.uint8)
    step = np.isin(codes, list(b"([{")).astype(np.int32) - np.isin(codes, list(b")]}"))
    return int(step.cumsum().max(initial=0))


def _check_package(file: Path) -> None:
    """Raise StageError where a layer within a package names a file outside it."""
    package = Sdf.ZipFile.Open(str(file))
    for name in package.GetFileNames() if package else []:
        if Path(name).suffix.lower() not in LAYERS:
            continue
        layer = f"{file}[{name}]"
        outside = [n for n in named_assets(layer) if os.path.isabs(n) or SCHEME.match(n) or ".." in Path(n).parts]
        for named in opened_assets(layer, outside) if outside else []:
            do = "name only files within the package"
            raise StageError(f"refers to @{named}@, outside its package", where=layer, do=do)


def _locate(named: str, layer: Path, folder: Path) -> list[Path]:
    """Find the files that `named`, an asset path authored in `layer`, stands for; several for <UDIM>."""
    do = "use a relative path to a file in the stage's own folder"
    if SCHEME.match(named):
        raise StageError(f"refers to @{named}@, and network and other schemes are not followed", where=layer, do=do)
    outer = named.split("[")[0] if named.endswith("]") else named
    full = Path(os.path.normpath(layer.parent / outer))
    if os.path.isabs(outer):
        raise StageError(f"refers to the absolute path @{named}@", where=layer, do=do)
    if not full.is_relative_to(folder):
        raise StageError(f"refers to @{named}@, which lies outside the stage's folder", where=layer, do=do)
    files = udim_files(full)
    for file in files:
        if file.resolve() != file:
            raise StageError(f"refers to @{named}@ through a symbolic link", where=layer, do=do)
    return [file for file in files if os.path.lexists(file)]
