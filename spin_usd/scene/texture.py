"""Values that vary over a surface: images, their placement on it, and primvars.

The terms are UsdUVTexture's. Colours are linear RGB with Rec. 709 primaries, or raw numbers for images of data.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import digest, frozen
from spin_usd.errors import GeometryError
from spin_usd.scene.content import NAME

Color = tuple[float, float, float]
"""Linear RGB with Rec. 709 primaries."""

RGBA = tuple[float, float, float, float]
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
WRAPS = ("repeat", "mirror", "clamp", "black")
OUTPUTS = ("rgb", "r", "g", "b", "a")


@dataclass(frozen=True, kw_only=True, eq=False)
class Image:
    """A picture: pixels (H, W, 4) float32 RGBA, linear or raw, the top row first. Equal when its keys are."""

    name: str
    pixels: NDArray[np.float32]

    def __post_init__(self) -> None:
        pixels = frozen(self.pixels, np.float32)
        if pixels.ndim != 3 or pixels.shape[2] != 4 or not pixels.size:
            raise GeometryError(f"image {self.name} has shape {pixels.shape}, expected (H, W, 4)")
        if not np.isfinite(pixels).all():
            raise GeometryError(f"image {self.name} holds NaN or infinity")
        object.__setattr__(self, "pixels", pixels)

    @cached_property
    def key(self) -> str:
        return digest(self.pixels)

    @property
    def size(self) -> tuple[int, int]:
        """The image's rows and columns."""
        return self.pixels.shape[0], self.pixels.shape[1]

    @cached_property
    def extremes(self) -> NDArray[np.float32]:
        """(2, 4) the lowest and the highest number of each channel."""
        each = [(band.min((0, 1)), band.max((0, 1))) for band in self.bands()]
        return frozen(
            np.stack([np.min([low for low, _ in each], 0), np.max([high for _, high in each], 0)]), np.float32
        )

    @property
    def bounds(self) -> NDArray[np.float32]:
        """(2, 4) lower and upper bounds of each channel: the cheapest to find."""
        return self.extremes

    def bands(self) -> Iterator[NDArray[np.float32]]:
        """Yield the pixels in parts of some whole rows each, from the top."""
        yield self.pixels

    def channel(self, number: int) -> NDArray[np.float32]:
        """Return the numbers (H, W) of one channel."""
        return self.pixels[..., number]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Image) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


class FileImage(Image):
    """An image that stays in its file until its numbers are needed: one of 8192 x 8192 pixels takes 1 GiB.

    Code that needs all numbers once uses `bands`, which are not kept; `pixels` and `channel` are kept.
    """

    def __init__(
        self,
        *,
        name: str,
        size: tuple[int, int],
        whole: bool,
        key: Callable[[], str],
        bands: Callable[[], Iterator[NDArray[np.float32]]],
    ) -> None:
        """Describe an image without decoding it.

        Args:
            size: Rows and columns.
            whole: Whether the file has whole numbers, which represent 0 to 1.
            key: Returns the digest of the numbers' sources, without decoding them.
            bands: Decodes them, like Image.bands.
        """
        object.__setattr__(self, "name", name)
        self._size, self._whole, self._key, self._bands = size, whole, key, bands
        self._channels: dict[int, NDArray[np.float32]] = {}

    @cached_property
    def key(self) -> str:
        return self._key()

    @cached_property
    def pixels(self) -> NDArray[np.float32]:
        return frozen(self._gathered(slice(0, 4)), np.float32)

    @property
    def size(self) -> tuple[int, int]:
        return self._size

    @property
    def bounds(self) -> NDArray[np.float32]:
        return np.array([[0] * 4, [1] * 4], np.float32) if self._whole else self.extremes

    def bands(self) -> Iterator[NDArray[np.float32]]:
        return iter([self.pixels]) if "pixels" in self.__dict__ else self._bands()

    def channel(self, number: int) -> NDArray[np.float32]:
        if number not in self._channels:
            self._channels[number] = self._gathered(slice(number, number + 1))[..., 0]
        return self._channels[number]

    def _gathered(self, channels: slice) -> NDArray[np.float32]:
        found = np.empty((*self.size, channels.stop - channels.start), np.float32)
        row = 0
        for band in self.bands():
            found[row : row + len(band)] = band[..., channels]
            row += len(band)
        return found


@dataclass(frozen=True, kw_only=True)
class Tiles:
    """Images side by side, as in UDIM: each covers the unit square of the coordinates whose lower left corner is its
    (column, row), in ascending order of rows, then columns. Elsewhere all numbers are 0."""

    name: str = field(compare=False, metadata=NAME)
    images: tuple[tuple[tuple[int, int], Image], ...]

    @property
    def size(self) -> tuple[int, int]:
        """The most rows and the most columns of any of them."""
        rows, columns = zip(*(image.size for _, image in self.images), strict=True)
        return max(rows), max(columns)

    @cached_property
    def extremes(self) -> NDArray[np.float32]:
        """(2, 4) the lowest and the highest number of each channel, the 0 between the tiles included."""
        found = np.stack([*(image.extremes for _, image in self.images), np.zeros((2, 4), np.float32)])
        return frozen(np.stack([found[:, 0].min(0), found[:, 1].max(0)]), np.float32)

    @property
    def bounds(self) -> NDArray[np.float32]:
        """(2, 4) as Image.bounds has it, of all of them and the 0 between them."""
        found = np.stack([*(image.bounds for _, image in self.images), np.zeros((2, 4), np.float32)])
        return np.stack([found[:, 0].min(0), found[:, 1].max(0)])


@dataclass(frozen=True, kw_only=True)
class Coordinates:
    """The place of a surface point on an image; (0, 0) is the image's lower left corner, (1, 1) its upper right."""

    primvar: str | None = "st"
    """The name of the 2-D primvar that gives it."""
    constant: tuple[float, float] = (0.0, 0.0)
    """Place if `primvar` is None."""
    matrix: tuple[float, float, float, float, float, float] = IDENTITY
    """The rows of [[a, b, c], [d, e, f]], which moves it: s' = a s + b t + c, t' = d s + e t + f."""


@dataclass(frozen=True, kw_only=True)
class Texture:
    """A UsdUVTexture's output: `image` looked up bilinearly at `coordinates`, times `scale` plus `bias` (RGBA)."""

    path: str = field(compare=False, metadata=NAME)
    image: Image | Tiles
    output: str = "rgb"
    """One of OUTPUTS."""
    coordinates: Coordinates = Coordinates()
    wrap: tuple[str, str] = ("repeat", "repeat")
    """Wrap modes of s and t, each one of WRAPS; tiles are all clamped to their own edges."""
    scale: RGBA = (1.0, 1.0, 1.0, 1.0)
    bias: RGBA = (0.0, 0.0, 0.0, 0.0)

    @property
    def images(self) -> tuple[Image, ...]:
        """The one that it looks up, or all its tiles."""
        return (self.image,) if isinstance(self.image, Image) else tuple(image for _, image in self.image.images)


@dataclass(frozen=True, kw_only=True)
class Primvar:
    """The value of Mesh.primvars[name], interpolated over each face."""

    name: str


Scalar = float | Texture | Primvar
Colored = Color | Texture | Primvar
