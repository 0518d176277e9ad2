"""Missing files without which a target can be shown: images with an authored fallback, and files that only other
renderers read."""

from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdShade

from spin_usd.stage.usd.image_tiles import is_tiled
from spin_usd.stage.usd.values import read, read_any

TEXTURE = "UsdUVTexture"


def lacks_file(shader: UsdShade.Shader, asset: Any) -> bool:
    """Return whether `asset`, the file of the texture `shader`, is missing while a fallback is authored."""
    if not isinstance(asset, Sdf.AssetPath) or not asset.path or asset.resolvedPath or is_tiled(asset):
        return False
    fallback = shader.GetInput("fallback")
    return bool(fallback) and fallback.GetAttr().HasAuthoredValue()


def dispensable_images(stage: Usd.Stage) -> set[Path]:
    """Return the paths of missing images for which every texture that names them has a fallback."""
    dispensable: dict[Path, bool] = {}
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        shader = UsdShade.Shader(prim)
        file = shader.GetInput("file") if shader and read(shader.GetIdAttr()) == TEXTURE else None
        if not file:
            continue
        asset = read_any(file.GetAttr())
        if isinstance(asset, Sdf.AssetPath) and not asset.resolvedPath:
            path = _expected_path(file.GetAttr(), asset)
            dispensable[path] = dispensable.get(path, True) and lacks_file(shader, asset)
    return {path for path, every in dispensable.items() if every}


def files_of_others(stage: Usd.Stage) -> set[Path]:
    """Return the paths of missing files that only shaders other than textures name, such as MDL's."""
    found: dict[Path, bool] = {}
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        shader = UsdShade.Shader(prim)
        for attribute in prim.GetAuthoredAttributes() if shader else ():
            asset = read_any(attribute)
            if isinstance(asset, Sdf.AssetPath) and asset.path and not asset.resolvedPath:
                path = _expected_path(attribute, asset)
                found[path] = found.get(path, True) and read(shader.GetIdAttr()) != TEXTURE
    return {path for path, every in found.items() if every}


def _expected_path(attribute: Usd.Attribute, asset: Sdf.AssetPath) -> Path:
    """Return the path at which the layer with the strongest opinion looks for `asset`. Where a name without "./" is not
    beside the layer, USD gives the working folder's."""
    spec = attribute.GetPropertyStack(Usd.TimeCode.Default())[0]
    anchored = asset.path if asset.path[0] in "./" else f"./{asset.path}"
    return Path(spec.layer.ComputeAbsolutePath(anchored)).resolve()
