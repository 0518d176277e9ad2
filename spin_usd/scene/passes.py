"""The results of a renderer."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from mmap import mmap

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import GeometryError
from spin_usd.geometry.region import Region
from spin_usd.scene.texture import Color

Float32 = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True, eq=False)
class Visibility:
    """face (rows, columns) int32: the triangle that the ray through each pixel centre of `region` meets first,
    as the number of a face of the mesh; -1 where it meets none. Nothing outside the region is seen. Of several bodies
    the numbers run through their meshes, one after the other, and `bodies` has the same of each body as if it were
    alone."""

    region: Region
    face: NDArray[np.int32]
    bodies: "tuple[Visibility, ...]" = ()

    def __post_init__(self) -> None:
        if self.face.shape != self.region.shape or self.face.dtype != np.int32:
            raise GeometryError(f"visibility is {self.face.dtype}{self.face.shape}, expected int32{self.region.shape}")

    @property
    def of_each_body(self) -> "tuple[Visibility, ...]":
        """Visibility of each body as if it were alone, in the order of Scene.one_body_scenes."""
        return self.bodies or (self,)


@dataclass(frozen=True, kw_only=True, eq=False)
class Radiance:
    """The bodies' linear radiance in W/m2/sr over the pixels of `region`, separated by source of light.

    groups (G, rows, columns, 3) float32: radiance from each of the scene's light groups (scene.derived.light_groups);
    the total is their sum. coverage (rows, columns) float32: the share of each pixel that they cover. The radiance is
    the whole pixel's (premultiplied): the background adds (1 - coverage) times its own. There are no bodies outside the
    region.
    """

    region: Region
    groups: Float32
    coverage: Float32

    def __post_init__(self) -> None:
        groups, coverage, shape = self.groups, self.coverage, self.region.shape
        if groups.ndim != 4 or groups.shape[1:] != (*shape, 3) or groups.dtype != np.float32:
            raise GeometryError(f"radiance is {groups.dtype}{groups.shape}, expected float32(groups, *{shape}, 3)")
        if coverage.shape != shape or coverage.dtype != np.float32:
            raise GeometryError(f"coverage is {coverage.dtype}{coverage.shape}, expected float32{shape}")

    @classmethod
    def of(cls, region: Region, rgba: Float32) -> "Radiance":
        """Return the radiance of one group: rgba (rows, columns, 4), with the coverage in alpha."""
        return cls(region=region, groups=rgba[None, ..., :3], coverage=rgba[..., 3])

    @classmethod
    def dark(cls, region: Region, *, groups: int) -> "Radiance":
        """Black without coverage, with `groups` groups."""
        return cls(
            region=region,
            groups=np.zeros((groups, *region.shape, 3), np.float32),
            coverage=np.zeros(region.shape, np.float32),
        )

    @cached_property
    def rgba(self) -> Float32:
        """(rows, columns, 4): the radiance, and in alpha the coverage."""
        return np.concatenate([self.groups.sum(0, dtype=np.float32), self.coverage[..., None]], -1)

    @property
    def rgb(self) -> Float32:
        """(rows, columns, 3) without the coverage."""
        return self.rgba[..., :3]

    def within(self, region: Region) -> "Radiance":
        """Return its part in `region`."""
        shown = self.region & region
        part = shown.within(self.region).slices
        return Radiance(region=shown, groups=self.groups[:, *part], coverage=self.coverage[part])

    @property
    def nbytes(self) -> int:
        """How many bytes its arrays take."""
        return self.groups.nbytes + self.coverage.nbytes

    def in_own_pages(self) -> "Radiance":
        """Return the same in memory of its own: among other arrays of other sizes it would leave holes, of which a
        process grows as renders come and go."""
        pages, at = np.frombuffer(mmap(-1, max(self.nbytes, 1)), np.uint8), self.groups.nbytes
        groups = pages[:at].view(np.float32).reshape(self.groups.shape)
        coverage = pages[at : self.nbytes].view(np.float32).reshape(self.coverage.shape)
        np.copyto(groups, self.groups)
        np.copyto(coverage, self.coverage)
        return replace(self, groups=groups, coverage=coverage)

    def relit(self, gains: Sequence[Color]) -> "Radiance":
        """Return the same with each group's light multiplied by its gain in red, green and blue."""
        if len(gains) != len(self.groups):
            raise GeometryError(f"{len(gains)} gains are given for {len(self.groups)} groups of lights")
        lit = self.groups * np.array(gains, np.float32).reshape(-1, 1, 1, 3)
        return Radiance(region=self.region, groups=lit.sum(0, keepdims=True, dtype=np.float32), coverage=self.coverage)
