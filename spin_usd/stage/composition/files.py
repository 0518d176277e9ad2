"""Find and check the files that a stage is made of, before USD opens any of them.

USD's resolver follows absolute paths, `..`, symbolic links and named pipes without a warning. Here a stage may only
name files by relative paths that stay within its own folder; layers that travel with spin_usd, within theirs.
"""

import glob
import os
import re
import stat
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from pxr import Ar, Sdf, UsdUtils

from spin_usd.basics.resources import stages
from spin_usd.errors import StageError
from spin_usd.files.model_root import root_of
from spin_usd.files.user_file import open_file, read_bytes
from spin_usd.stage.usd.image_tiles import UDIM
from spin_usd.stage.usd.layer_file import layer_at
from spin_usd.stage.usd.parser_faults import parser_faults

LAYERS = (".usd", ".usda", ".usdc")
EXTENSIONS = (*LAYERS, ".usdz")
MAX_FILE_BYTES = 2**31
MAX_TEXT_BYTES = 2**28  # of a layer of text: USD parses some 20 MB a second
MAX_FILES = 10_000
MAX_DEPTH = 256  # USD's text parser recurses: 100,000 nested brackets overflow its stack
TEXT, CRATE = b"#usda", b"PXR-USDC"  # how layers begin
BLOCK = 2**22
QUOTED = re.compile(
    rb'"""(?s:[^"\\]|\\.|"(?!""))*+"""|"(?!"")(?:[^"\\\n]|\\.)*+"'
    rb"|'''(?s:[^'\\]|\\.|'(?!''))*+'''|'(?!'')(?:[^'\\\n]|\\.)*+'"
    rb"|@@@(?s:\\@@@|.)*?@@@|@(?!@@)[^@\n]*+@|<[^>\n]*+>|#[^\n]*+|//[^\n]*+|/\*(?s:.)*?\*/"
)
"""Strings, asset paths, paths and comments of USDA, whose brackets nest nothing."""
SCHEME = re.compile(r"^[A-Za-z][A-Za-z0-9+.-]+:")
PACK = "pack it again, with usdzip or UsdUtils.CreateNewUsdzPackage"
DESCRIPTIONS = ("assetInfo", "customData", "customLayerData")
STEPS = np.zeros(256, np.int8)
"""Change of the depth of brackets, by a byte of the text."""
STEPS[list(b"([{")], STEPS[list(b")]}")] = 1, -1
NO_BRACKETS = bytes(np.flatnonzero(STEPS == 0).tolist())


@dataclass(frozen=True, kw_only=True)
class Missing:
    """An asset path without a file, and the layer that names it."""

    name: str
    layer: Path

    def __str__(self) -> str:
        return f"@{self.name}@ named by {self.layer}"


@dataclass(frozen=True, kw_only=True)
class Files:
    """All files that a stage depends on, over all variants, by their real paths."""

    root: Path
    found: tuple[Path, ...]
    """All of them, `root` first."""
    missing: tuple[Missing, ...]
    """Files that are named but do not exist."""


def files_of(path: str | Path, *, also_bundled: bool = False) -> Files:
    """Find all files that the layer at `path` depends on. `also_bundled`: it may name bundled files by absolute paths.

    Raises StageError for a path that leaves the stage's folder, or the `root_of` a model, a file that is not regular or
    too large, a layer that does not parse, or a time scale of zero or less.
    """
    root = _real(path)
    if root.suffix.lower() not in EXTENSIONS:
        raise StageError("is not a USD stage", where=path, do=f"give a file that ends in {', '.join(EXTENSIONS)}")
    if not root.exists():
        raise StageError("does not exist", where=path, do="check the path, or make a stage with spin-usd author")
    found: dict[Path, None] = {}
    missing: list[Missing] = []
    bundled = stages().resolve()
    folders = (bundled,) if root.is_relative_to(bundled) else (root_of(root), *([bundled] if also_bundled else []))
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
            located = _locate(named, file, folders)
            missing += [] if located else [Missing(name=named, layer=file)]
            queue += located
    return Files(root=root, found=tuple(found), missing=tuple(missing))


def udim_files(path: Path) -> list[Path]:
    """Return `path`, or the existing tiles where its name holds <UDIM>."""
    if UDIM not in path.name:
        return [path]
    before, after = (glob.escape(part) for part in path.name.split(UDIM, 1))
    return sorted(path.parent.glob(f"{before}[0-9][0-9][0-9][0-9]{after}"))


def _real(path: str | Path) -> Path:
    """Return the real path. Raises StageError for one that USD, whose paths are UTF-8, cannot open."""
    try:
        real = Path(path).resolve()
        str(real).encode()
    except UnicodeEncodeError:
        raise StageError("has a path that is not UTF-8", where=path, do="rename the folder or the file") from None
    except (OSError, ValueError) as error:
        raise StageError(f"cannot be the path of a stage ({error})", where=path, do="check the path") from None
    return real


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
        opened, status = Sdf.Layer.Find(str(file)), file.stat()
        version = status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns
        changed = opened is not None and opened.dirty  # in memory alone
        names = _named_in(file) if changed else _named_once(file, version)
        return names if all((file.parent / name).is_file() for name in names) else opened_assets(str(file), names)


@lru_cache(maxsize=1024)
def _named_once(file: Path, version: tuple[int, ...]) -> list[str]:
    """Return the list of `_named_in` for that version of a file, cached: the stages of all variants use the same
    files."""
    return _named_in(file)


def _named_in(file: Path) -> list[str]:
    """List every asset path that a checked layer names."""
    _check_layer(file)
    layer = layer_at(file)
    if layer.timeCodesPerSecond <= 0:  # USD would list time samples endlessly
        found = f"timeCodesPerSecond is {layer.timeCodesPerSecond:g}"
        raise StageError(found, where=file, do="set it to a positive number, 24 for instance")
    return named_assets(str(file))


def _check_layer(file: Path) -> None:
    """Raise StageError for a file that is not a layer, for text that is too long, and like `_refuse_nesting`."""
    with open_file(file, MAX_FILE_BYTES) as opened:
        head = opened.read(len(CRATE))
        if head.startswith(CRATE):
            return
        if not head.startswith(TEXT):
            raise StageError("is not a USD layer", where=file, do="write it again")
        if (size := os.fstat(opened.fileno()).st_size) > MAX_TEXT_BYTES:
            found = f"has {size} bytes of text, more than {MAX_TEXT_BYTES}"
            raise StageError(found, where=file, do="convert it to .usdc, which USD reads without parsing it")
    _refuse_nesting(read_bytes(file, MAX_TEXT_BYTES), file)


def _refuse_nesting(text: bytes, where: object) -> None:
    """Raise StageError for text whose brackets nest deeper than MAX_DEPTH."""
    if _depth(QUOTED.sub(b"", text)) > MAX_DEPTH:
        raise StageError(f"nests brackets deeper than {MAX_DEPTH}", where=where, do="flatten it")


def _depth(text: bytes) -> int:
    deepest = depth = 0
    brackets = text.translate(None, NO_BRACKETS)  # a tenth of a mesh's text
    for start in range(0, len(brackets), BLOCK):
        codes = np.frombuffer(brackets, np.uint8, min(BLOCK, len(brackets) - start), start)
        depths = depth + STEPS[codes].cumsum(dtype=np.int32)
        deepest, depth = max(deepest, int(depths.max())), int(depths[-1])
    return deepest


def _check_package(file: Path) -> None:
    """Raise StageError where a package breaks the rules of USDZ, holds another one or too long a layer, or where a
    layer in it nests brackets too deep or names a file outside it."""
    package = Sdf.ZipFile.Open(str(file))
    names = package.GetFileNames() if package else []
    if not names or Path(names[0]).suffix.lower() not in EXTENSIONS:
        found = f"begins with {names[0]!r}, and a package begins with its layer" if names else "is not a package"
        raise StageError(found, where=file, do=PACK)
    for name in names:
        layer, suffix = f"{file}[{name}]", Path(name).suffix.lower()
        if (info := package.GetFileInfo(name)).compressionMethod or info.encrypted:
            raise StageError("is compressed or encrypted, and a package stores its files plain", where=layer, do=PACK)
        if suffix == ".usdz":
            raise StageError("is a package within a package", where=layer, do="put its files into one")
        if suffix in LAYERS:
            _check_packed(package, name, layer)
            for named in _named_outside(layer):
                do = "name only files within the package"
                raise StageError(f"refers to @{named}@, outside its package", where=layer, do=do)


def _check_packed(package: Sdf.ZipFile, name: str, layer: str) -> None:
    if package.GetFileInfo(name).size > MAX_TEXT_BYTES:
        raise StageError(f"has more than {MAX_TEXT_BYTES} bytes", where=layer, do="put it beside the others unpacked")
    text = bytes(package.GetFile(name))
    if text.startswith(TEXT):
        _refuse_nesting(text, layer)


def _named_outside(layer: str) -> Iterator[str]:
    """Yield the asset paths of a packed layer that lead out of its package."""
    outside = [n for n in named_assets(layer) if os.path.isabs(n) or SCHEME.match(n) or ".." in Path(n).parts]
    yield from opened_assets(layer, outside) if outside else ()


def _locate(named: str, layer: Path, folders: tuple[Path, ...]) -> list[Path]:
    """Find the files of `named`, an asset path authored in `layer`; several for <UDIM>. They must lie in one of
    `folders`; absolute paths may name all of these but the first."""
    do = "use a relative path to a file in the stage's own folder, or of a model below author's --root FOLDER"
    if "\0" in named:
        raise StageError(f"refers to {named!r}, which no file is called", where=layer, do=do)
    if SCHEME.match(named):
        raise StageError(f"refers to @{named}@, and network and other schemes are not followed", where=layer, do=do)
    outer = Ar.SplitPackageRelativePathOuter(named)[0]
    full = Path(os.path.normpath(layer.parent / outer))
    if os.path.isabs(outer) and not any(full.is_relative_to(folder) for folder in folders[1:]):
        raise StageError(f"refers to the absolute path @{named}@", where=layer, do=do)
    if not any(full.is_relative_to(folder) for folder in folders):
        raise StageError(f"refers to @{named}@, which lies outside the stage's folder", where=layer, do=do)
    files = udim_files(full)
    for file in files:
        if file.resolve() != file:
            raise StageError(f"refers to @{named}@ through a symbolic link", where=layer, do=do)
    return [file for file in files if os.path.lexists(file)]


def named_assets(identifier: str) -> list[str]:
    """List every asset path authored in the layer, descriptions included."""
    return [name for kind in UsdUtils.ExtractExternalReferences(identifier) for name in kind]


def opened_assets(identifier: str, names: Iterable[str]) -> list[str]:
    """Select those of `names` that the layer names outside descriptions: in arcs, clips and values.

    Not every asset path in a layer is opened by a stage. Metadata on an asset (assetInfo, customData) contain some too:
    an identifier is the asset's name at its origin, and nothing opens it.
    """
    bare = Sdf.Layer.CreateAnonymous()
    bare.TransferContent(layer_at(identifier))
    bare.Traverse(Sdf.Path.absoluteRootPath, lambda path: _strip(bare, path))
    opened: set[str] = set()

    def note(name: str) -> str:
        opened.add(name)
        return name

    UsdUtils.ModifyAssetPaths(bare, note)
    return [name for name in names if name in opened]


def _strip(layer: Sdf.Layer, path: Sdf.Path) -> None:
    spec = layer.GetObjectAtPath(path)
    for name in DESCRIPTIONS:
        if spec and spec.HasInfo(name):
            spec.ClearInfo(name)
