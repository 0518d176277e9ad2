"""Image files of a stage, as linear or raw RGBA, for UsdUVTexture and dome lights.

Their numbers are decoded on demand, by bands: labels need only those of cut-outs. Colour spaces follow the
UsdPreviewSurface specification, version 2.6. sRGB is decoded texel by texel, before any interpolation; alpha is never a
colour, and never multiplied into one.
"""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np
import OpenImageIO as oiio  # noqa: N813  the name its own documentation uses
from numpy.typing import NDArray
from pxr import Ar, Sdf, Usd

from spin_usd.basics.arrays import digest
from spin_usd.errors import InputError, SpinError, StageError, UnsupportedError
from spin_usd.files.sha256 import sha256_of
from spin_usd.files.size_limits import UNBOUNDED
from spin_usd.files.user_file import open_file
from spin_usd.scene.derived import srgb
from spin_usd.scene.texture import FileImage, Image, Tiles
from spin_usd.stage.usd.image_tiles import is_tiled, tiles_of

SUFFIXES = (".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff", ".hdr", ".tga")
COLOR_SPACES = ("auto", "raw", "sRGB")
MAX_PIXELS = 2**26  # of one image: 8192 x 8192, 1 GiB decoded
MAX_TOTAL_PIXELS = 2**28  # of all images of a reader
BAND_PIXELS = 2**20  # decoded at once: 16 MiB
MAX_HEADER = 2**22  # bytes of a PNG in which its chunks before the first of pixels are looked for
LEVELS = {oiio.UINT8: 2**8, oiio.UINT16: 2**16}  # of the numbers of an image's file
WHOLE = {levels: kind for kind, levels in LEVELS.items()}
TURNS = {2: (1, 0), 3: (0, 2), 4: (1, 2), 5: (1, 1), 6: (0, 3), 7: (1, 3), 8: (0, 1)}
"""By Orientation of EXIF whether an image is mirrored left to right, and then how many quarter turns to the left."""
WRAPS = {"black": "black", "clamp": "clamp", "periodic": "repeat", "mirror": "mirror"}
"""Wrap modes as OpenImageIO names them in a file's metadata, and as USD does."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ImageSource:
    """The file of an image, or the part of a package that is one."""

    path: str
    """As USD resolves it."""
    columns: tuple[int, int]
    """The first and the end."""
    rows: tuple[int, int]
    """The first and the end."""
    tile_rows: int
    """Rows of a tile in the file, 0 for a file of rows."""
    channels: tuple[str, ...]
    """Their names."""
    levels: int | None
    """Number of levels of whole numbers, which stand for 0 to 1; None for others."""
    linearised: bool
    """Whether its colours are sRGB's, to be decoded."""
    orientation: int = 1
    """EXIF orientation to turn it by, 1 for none."""

    @property
    def size(self) -> tuple[int, int]:
        """Its rows and columns."""
        return self.rows[1] - self.rows[0], self.columns[1] - self.columns[0]

    def key(self) -> str:
        """Return the digest of the file's bytes and of how they are understood."""
        how = ["image file", "sRGB" if self.linearised else "raw"]
        how += [str(self.orientation)] if self.orientation > 1 else []
        if Ar.IsPackageRelativePath(self.path):
            return digest(how, hashlib.sha256(_bytes_in_package(self.path)).hexdigest())
        return digest(how, sha256_of(Path(self.path)))

    def bands(self) -> Iterator[NDArray[np.float32]]:
        """Yield the numbers (rows, W, 4) from the top, with sRGB colours made linear. Raises StageError if they are
        damaged or not finite."""
        for values in self._encoded(oiio.FLOAT):
            pixels = _rgba(values, self.channels)
            if not (self.levels or np.isfinite(pixels).all()):
                raise StageError("holds NaN or infinity", do="fix it")
            if self.linearised:
                pixels[..., :3] = _linear(pixels[..., :3], self.levels)
            yield pixels

    def shown(self) -> tuple[tuple[int, int], Callable[[], Iterator[NDArray[np.float32]]]]:
        """Return its rows and columns, and an iterator of its upright `bands`."""
        if self.orientation not in TURNS:
            return self.size, self.bands
        mirrored, turns = TURNS[self.orientation]

        def bands() -> Iterator[NDArray[np.float32]]:
            whole = np.concatenate(list(self.bands()))
            yield np.ascontiguousarray(np.rot90(whole[:, ::-1] if mirrored else whole, turns))

        return (self.size[::-1] if turns % 2 else self.size), bands

    @cached_property
    def damage(self) -> StageError | None:
        """The error of `bands`, None if there is none: whole numbers are only decompressed to find it."""
        try:
            for _ in self._encoded(WHOLE[self.levels]) if self.levels else self.bands():
                pass
        except StageError as found:
            return found
        return None

    def _encoded(self, kind: Any) -> Iterator[NDArray[Any]]:
        """Yield the file's contents (rows, W, C), as numbers of that kind."""
        width, count = self.size[1], len(self.channels)
        step = max(BAND_PIXELS // width, 1)
        step = -(-step // self.tile_rows) * self.tile_rows if self.tile_rows else step
        with _opened(self.path) as source:
            if (source.spec().height, source.spec().width, source.spec().nchannels) != (*self.size, count):
                raise StageError("has changed since it was opened", do="try again")
            for row in range(*self.rows, step):
                end = min(row + step, self.rows[1])
                if self.tile_rows:
                    values = source.read_tiles(*self.columns, row, end, 0, 1, 0, count, kind)
                else:
                    values = source.read_scanlines(row, end, 0, 0, count, kind)
                reason = source.geterror()
                if values is None or reason:
                    detail = reason.splitlines()[-1] if reason else "no reason given"
                    raise StageError(f"is cut short or damaged ({detail})", do="copy or make it again")
                yield values.reshape(end - row, width, count)


@dataclass(frozen=True, kw_only=True, eq=False)
class Decoded:
    """An image, and the wrap modes of s and t in its file's metadata ("black" if missing)."""

    image: Image
    wrap: tuple[str, str]
    source: ImageSource


@dataclass(eq=False)
class Images:
    """A cache of images: each file is opened once for each colour space. `before`: the `decoded` of another reader of
    the same, unchanged files. `check`: whether each image is decoded when it is opened, to find damage early."""

    before: Mapping[tuple[str, str], Decoded] = field(default_factory=dict)
    check: bool = True
    decoded: dict[tuple[str, str], Decoded] = field(default_factory=dict)
    _pixels: int = 0

    def read(
        self,
        asset: Sdf.AssetPath,
        color_space: str,
        prim: Usd.Prim,
        *,
        one_of_many: bool = False,
        upright: bool = False,
    ) -> Decoded:
        """Open the file that `asset`, a value of `prim`, names. color_space: one of COLOR_SPACES. one_of_many: a
        picture shows at most one of them, and its pixels are not kept. upright: whether it is a photograph, turned by
        EXIF, not a texture, whose coordinates refer to the stored image.

        Raises StageError, with the prim and the file, for a file that is missing, outside the stage's folder, too
        large, damaged or not finite, UnsupportedError for a format that we do not read.
        """
        path = _checked(asset, prim)
        key = (path, f"{color_space} upright" if upright else color_space)
        if key not in self.decoded:
            with _named(f"its image @{asset.path}@", prim.GetPath()):
                found = self.before.get(key) or _decode(path, color_space, upright=upright)
                if self.check and (damage := found.source.damage):
                    raise damage
            self.decoded[key] = found
            rows, columns = found.image.size
            self._pixels += 0 if one_of_many else rows * columns
        if self._pixels > MAX_TOTAL_PIXELS:
            found_all = f"its image @{asset.path}@ brings the stage's images to more than {MAX_TOTAL_PIXELS} pixels"
            raise StageError(found_all, where=prim.GetPath(), do="make them smaller")
        return self.decoded[key]

    def read_tiles(self, asset: Sdf.AssetPath, color_space: str, prim: Usd.Prim) -> Tiles:
        """Decode the set of tiles that `asset`, a resolved value of `prim`, names. Raises as `read`, with each tile's
        file."""
        tiles = [(corner, self.read(tile, color_space, prim).image) for corner, tile in tiles_of(asset)]
        if not tiles:
            found = f"its image @{asset.path}@ has no tile"
            raise StageError(found, where=prim.GetPath(), do="put tiles such as 1001 where the layer looks")
        return Tiles(name=Path(asset.path).name, images=tuple(tiles))


def image_in(file: Path, color_space: str) -> Image:
    """Return the photograph or map in a `file` that no stage names yet, upright. Raises InputError where no stage could
    use it."""
    try:
        found = _decode(str(file), color_space, upright=True)
        if damage := found.source.damage:
            raise damage
        return found.image
    except SpinError as error:
        raise InputError(error.found, where=file, do=error.do) from None


@contextmanager
def _named(name: str, where: object) -> Iterator[None]:
    """Add the image and the place that names it to errors."""
    try:
        yield
    except SpinError as error:
        raise type(error)(f"{name} {error.found}", where=where, do=error.do) from None


def _checked(asset: Sdf.AssetPath, prim: Usd.Prim) -> str:
    """Return the resolved path. Raises StageError where it lies outside the stage's own folder."""
    path, where = asset.resolvedPath, prim.GetPath()
    if is_tiled(asset):
        raise UnsupportedError(f"its image @{asset.path}@ is a set of tiles", where=where, do="use one image")
    if not path:
        raise StageError(f"its image @{asset.path}@ does not exist", where=where, do="put it where the layer looks")
    outer = Path(Ar.SplitPackageRelativePathOuter(path)[0]).resolve()
    folder = Path(prim.GetStage().GetRootLayer().realPath).resolve().parent
    if not outer.is_relative_to(folder):
        raise StageError(f"its image @{asset.path}@ lies outside the stage's folder", where=where, do="move it inside")
    if _suffix(path) not in SUFFIXES:
        do = f"convert it to one of {', '.join(SUFFIXES)}"
        raise UnsupportedError(f"its image @{asset.path}@ is not of a kind that is read", where=where, do=do)
    return str(path)


def _suffix(path: str) -> str:
    return Path(_inner(path)).suffix.lower()


def _inner(path: str) -> str:
    """Return the path within the package, where `path` lies in one."""
    return Ar.SplitPackageRelativePathInner(path)[1] or path


def _decode(path: str, color_space: str, *, upright: bool) -> Decoded:
    """Open the file at `path`. Raises SpinError that names neither file nor prim."""
    with _opened(path) as source:
        spec = source.spec()
    _check_size(spec)
    of = ImageSource(
        path=path,
        columns=(spec.x, spec.x + spec.width),
        rows=(spec.y, spec.y + spec.height),
        tile_rows=spec.tile_height if spec.tile_width else 0,
        channels=tuple(spec.channelnames),
        levels=LEVELS.get(spec.format.basetype),
        linearised=color_space == "sRGB" or (color_space == "auto" and _is_srgb(spec, _head(path))),
        orientation=spec.get_int_attribute("Orientation", 1) if upright else 1,
    )
    _rgba(np.zeros((1, 1, spec.nchannels), np.float32), of.channels)  # refuses channels without a meaning

    size, own_bands = of.shown()

    def bands() -> Iterator[NDArray[np.float32]]:
        with _named("its image", path):
            yield from own_bands()

    name = Path(_inner(path)).name
    image = FileImage(name=name, size=size, whole=of.levels is not None, key=of.key, bands=bands)
    return Decoded(image=image, wrap=_wrap(spec), source=of)


@contextmanager
def _opened(path: str) -> Iterator[Any]:
    """Open an image with its alpha apart from its colours. Raises SpinError that names neither file nor prim."""
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    with _named_file(path) as file:
        source = oiio.ImageInput.open(file, hints)
        if source is None:
            raise StageError(f"cannot be decoded ({oiio.geterror()})", do="make it again")
        try:
            yield source
        finally:
            source.close()


@contextmanager
def _named_file(path: str) -> Iterator[str]:
    """Give the image a file of its own where it lies in a package: OpenImageIO's Python reads from named files only."""
    if not Ar.IsPackageRelativePath(path):
        yield path
        return
    with NamedTemporaryFile(suffix=_suffix(path)) as file:
        file.write(_bytes_in_package(path))
        file.flush()
        yield file.name


def _bytes_in_package(path: str) -> bytes:
    with Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path)) as asset:
        return bytes(asset.GetBuffer()) if asset else b""


def _head(path: str) -> bytes:
    """Return the first bytes of an image's file."""
    if Ar.IsPackageRelativePath(path):
        return _bytes_in_package(path)[:MAX_HEADER]
    with open_file(Path(path), UNBOUNDED) as stream:
        return stream.read(MAX_HEADER)


def _linear(encoded: NDArray[np.float32], levels: int | None) -> NDArray[np.float32]:
    """Return linear values of code values. Whole numbers go through a table made in double precision: its rounding to
    float32 hides that powers differ in the last bit between processors."""
    if levels is None:
        return srgb.decode(encoded).astype(np.float32)
    return np.asarray(_linear_table(levels).take(np.rint(encoded * np.float32(levels - 1)).astype(np.intp)))


@lru_cache(maxsize=2)
def _linear_table(levels: int) -> NDArray[np.float32]:
    return srgb.decode(np.arange(levels) / (levels - 1)).astype(np.float32)


def _check_size(spec: Any) -> None:
    if spec.width * spec.height > MAX_PIXELS:
        found = f"has {spec.width} x {spec.height} pixels, more than {MAX_PIXELS}"
        raise StageError(found, do="make it smaller")
    if spec.depth > 1 or spec.width < 1 or spec.height < 1:
        raise UnsupportedError("is not an image of rows and columns", do="make it again")
    if (spec.full_x, spec.full_y, spec.full_width, spec.full_height) != (spec.x, spec.y, spec.width, spec.height):
        raise UnsupportedError("has a data window that differs from its display window", do="write it without one")


def _rgba(values: NDArray[np.float32], names: Sequence[str]) -> NDArray[np.float32]:
    """Arrange channels as RGBA (H, W, 4): a grey channel for all three colours, alpha 1 if missing."""
    grey = [name for name in names if name not in "RGBA"]
    if set("RGB") <= set(names):
        colors = [names.index(name) for name in "RGB"]
    elif len(names) == 1 or (len(names) == 2 and "A" in names and len(grey) == 1):
        colors = [0 if len(names) == 1 else names.index(grey[0])] * 3
    else:
        raise UnsupportedError(f"has the channels {', '.join(names[:8])}", do="give it R, G, B, or one channel")
    alpha = values[..., names.index("A")] if "A" in names and len(names) > 1 else np.ones(values.shape[:2], np.float32)
    return np.concatenate([values[..., colors], alpha[..., None]], -1)


def _is_srgb(spec: Any, data: bytes) -> bool:
    """Apply the specification's rule for "auto": sRGB where the file's own metadata name it, else where it has 8 bits
    and 3 or 4 channels. OpenImageIO reports sRGB by default, so its report alone does not count."""
    space = spec.get_string_attribute("oiio:ColorSpace")
    if space.startswith("g22"):
        return True
    if space and not space.startswith("srgb"):
        return False
    header = data[: max(data.find(b"IDAT"), 0)]  # of a PNG: its sRGB chunk, or the name of its profile
    profile = spec.get_string_attribute("ICCProfile:profile_description")
    if b"sRGB" in header or profile.startswith("sRGB") or spec.get_int_attribute("Exif:ColorSpace") == 1:
        return True
    return bool(spec.format.basetype == oiio.UINT8 and spec.nchannels in (3, 4))


def _wrap(spec: Any) -> tuple[str, str]:
    """Return the wrap modes of s and t. Source: OpenImageIO's documentation, metadata "wrapmodes"."""
    modes = [WRAPS.get(mode.strip(), "black") for mode in spec.get_string_attribute("wrapmodes").split(",")]
    return modes[0], modes[-1]
