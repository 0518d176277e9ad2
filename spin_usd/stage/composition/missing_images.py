"""Textures whose image is not there, though a value to take instead of it is authored."""

from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdShade

from spin_usd.stage.usd.image_tiles import is_tiled

TEXTURE = "UsdUVTexture"


def lacks_file(shader: UsdShade.Shader, asset: Any) -> bool:
    """Whether `asset`, which `shader` looks up, names a file that is not there, while a fallback is authored."""
    if not isinstance(asset, Sdf.AssetPath) or not asset.path or asset.resolvedPath or is_tiled(asset):
        return False
    fallback = shader.GetInput("fallback")
    return bool(fallback) and fallback.GetAttr().HasAuthoredValue()


def dispensable_images(stage: Usd.Stage) -> set[Path]:
    """The images that are missing and for which every texture that names them has a fallback: where they would lie."""
    spared: dict[Path, bool] = {}
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        shader = UsdShade.Shader(prim)
        file = shader.GetInput("file") if shader and shader.GetIdAttr().Get() == TEXTURE else None
        if not file:
            continue
        asset = file.Get()
        if isinstance(asset, Sdf.AssetPath) and not asset.resolvedPath:
            place = _place(file.GetAttr(), asset)
            spared[place] = spared.get(place, True) and lacks_file(shader, asset)
    return {place for place, spare in spared.items() if spare}


def _place(attribute: Usd.Attribute, asset: Sdf.AssetPath) -> Path:
    """Where the layer with the strongest opinion looks for `asset`."""
    spec = attribute.GetPropertyStack(Usd.TimeCode.Default())[0]
    return Path(spec.layer.ComputeAbsolutePath(asset.path)).resolve()
