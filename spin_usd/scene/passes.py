"""What a renderer hands back."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import GeometryError
from spin_usd.geometry.region import Region


@dataclass(frozen=True, kw_only=True, eq=False)
class Visibility:
    """face (rows, columns) int32: the triangle that the ray through each pixel centre of `region` meets first,
    as an index into Mesh.faces; -1 where it meets none. Nothing outside the region is seen."""

    region: Region
    face: NDArray[np.int32]

    def __post_init__(self) -> None:
        if self.face.shape != self.region.shape or self.face.dtype != np.int32:
            raise GeometryError(f"visibility is {self.face.dtype}{self.face.shape}, expected int32{self.region.shape}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Radiance:
    """rgba (rows, columns, 4) float32 of the pixels of `region`: linear radiance of the target in W/m2/sr, and in alpha
    the share of each pixel that it covers. The radiance is that of the whole pixel (premultiplied): what lies behind
    adds (1 - alpha) times its own. Outside the region the target is nowhere."""

    region: Region
    rgba: NDArray[np.float32]

    def __post_init__(self) -> None:
        if self.rgba.shape != (*self.region.shape, 4) or self.rgba.dtype != np.float32:
            found = f"radiance is {self.rgba.dtype}{self.rgba.shape}"
            found = f"radiance is {self.rgba.dtype}{self.rgba.shape}"
            raise GeometryError(f"{found}, expected float32{self.region.shape}x4")

    @property
    def rgb(self) -> NDArray[np.float32]:
        """(rows, columns, 3) without the coverage."""
        return self.rgba[..., :3]
