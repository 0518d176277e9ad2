"""Materials of surfaces: UsdPreviewSurface."""

from dataclasses import dataclass, field
from functools import cached_property

from spin_usd.basics.arrays import digest
from spin_usd.scene.content import NAME, content
from spin_usd.scene.texture import Colored, Primvar, Scalar, Texture

ROUNDING = 1e-6  # of float32, which may take a share just above 1
INFINITY = float("inf")
TRANSPARENT, PRESENCE = "transparent", "presence"


@dataclass(frozen=True, kw_only=True)
class Limits:
    """An input's name in UsdPreviewSurface, how many numbers it has, and the lowest and highest that mean anything."""

    name: str
    size: int = 1
    low: float = 0.0
    high: float = 1 + ROUNDING


LIMITS = {
    "diffuse_color": Limits(name="diffuseColor", size=3),  # more would reflect more than arrives
    "emissive_color": Limits(name="emissiveColor", size=3, high=1e15),  # as a lamp: far above any source
    "specular_color": Limits(name="specularColor", size=3),
    "metallic": Limits(name="metallic"),
    "roughness": Limits(name="roughness"),
    "clearcoat": Limits(name="clearcoat"),
    "clearcoat_roughness": Limits(name="clearcoatRoughness"),
    "opacity": Limits(name="opacity"),
    "opacity_threshold": Limits(name="opacityThreshold"),
    "ior": Limits(name="ior", low=1, high=1000),  # of a metal 10; as high as Blender's goes, a mirror
    "normal": Limits(name="normal", size=3, low=-INFINITY, high=INFINITY),
}
"""Of each field of Material that holds numbers."""


@dataclass(frozen=True, kw_only=True)
class Material:
    """The inputs of UsdPreviewSurface by its own names, each a constant, a texture or a primvar.

    `normal` is in tangent space, None for the surface's own. `opacity_threshold` above 0 makes a cut-out: a point whose
    opacity is below it does not exist, for pictures and labels alike; else `opacity_mode` selects whether a transparent
    surface still reflects ("transparent") or is absent by that share ("presence"). Displacement has already moved the
    mesh, and a path tracer computes occlusion itself, so neither is here.
    """

    path: str = field(compare=False, metadata=NAME)
    diffuse_color: Colored = (0.18, 0.18, 0.18)
    emissive_color: Colored = (0.0, 0.0, 0.0)
    use_specular_workflow: bool = False
    specular_color: Colored = (0.0, 0.0, 0.0)
    metallic: Scalar = 0.0
    roughness: Scalar = 0.5
    clearcoat: Scalar = 0.0
    clearcoat_roughness: Scalar = 0.01
    opacity: Scalar = 1.0
    opacity_threshold: float = 0.0
    opacity_mode: str = TRANSPARENT
    ior: Scalar = 1.5
    normal: Texture | Primvar | tuple[float, float, float] | None = None

    @cached_property
    def key(self) -> str:
        return digest([content(getattr(self, name)) for name in sorted(self.__dataclass_fields__) if name != "path"])

    @property
    def name(self) -> str:
        """Return the name of the material's prim; empty for a displayColor."""
        return "" if "." in self.path else self.path.rpartition("/")[2]

    @property
    def tangent_primvar(self) -> str:
        """The 2-D primvar along which its normal map turns normals: their texture's own, else USD's usual `st`."""
        texture = self.normal
        return (isinstance(texture, Texture) and texture.coordinates.primvar) or "st"

    @property
    def absent(self) -> bool:
        """True where nothing of it can be seen: its opacity is the constant 0, and no light or gloss of it remains, as
        they do in the mode TRANSPARENT, of glass."""
        black = (0.0, 0.0, 0.0)
        dull = self.specular_color == black if self.use_specular_workflow else self.ior == 1.0
        remains = self.emissive_color != black or self.clearcoat != 0.0 or not dull
        return self.opacity == 0.0 and (self.cut_out or self.opacity_mode == PRESENCE or not remains)

    @property
    def cut_out(self) -> bool:
        """True where some of its points may not be there."""
        return self.opacity_threshold > 0
