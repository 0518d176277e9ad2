"""What a UsdPreviewSurface is made of: numbers, and pictures of a size in metres."""

from dataclasses import dataclass
from typing import Any, TypeAlias

from numpy.typing import NDArray

from materials.wear import METRES

Array: TypeAlias = NDArray[Any]
Colour: TypeAlias = tuple[float, float, float]  # linear, Rec. 709


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A texture on a surface: one copy of it covers `metres` of st, turned by `degrees`. `raw`: numbers, not sRGB."""

    file: str
    metres: tuple[float, float]
    degrees: float = 0.0
    raw: bool = True


@dataclass(frozen=True, kw_only=True)
class Sample:
    """`output` of a picture, times `scale` plus `bias`."""

    picture: Picture
    output: str
    scale: float | Colour = 1.0
    bias: float = 0.0


@dataclass(frozen=True, kw_only=True)
class MaterialValues:
    """Inputs of one UsdPreviewSurface; `normal` is a tangent-space picture."""

    colour: Colour | Sample
    metallic: float | Sample = 0.0
    roughness: float | Sample = 0.5
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.03
    ior: float = 1.5
    normal: Picture | None = None


def worn(mean: float, spread: float, *, size: float = METRES, degrees: float = 0.0, output: str = "r") -> Sample:
    """Values of `mean` plus and minus half of `spread`, as surfaces wear; each material at a size of its own."""
    picture = Picture(file="wear.png", metres=(size, size), degrees=degrees)
    return Sample(picture=picture, output=output, scale=spread, bias=mean - spread / 2)
