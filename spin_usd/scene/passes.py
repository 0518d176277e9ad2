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
    """rgb (rows, columns, 3) float32: linear radiance in W/m2/sr of the pixels of `region`; outside is background."""

    region: Region
    rgb: NDArray[np.float32]

    def __post_init__(self) -> None:
        if self.rgb.shape != (*self.region.shape, 3) or self.rgb.dtype != np.float32:
            raise GeometryError(f"radiance is {self.rgb.dtype}{self.rgb.shape}, expected float32{self.region.shape}x3")
