"""The asset paths that a layer names, and which of them bring something into a stage.

Metadata that describe an asset (assetInfo, customData) hold asset paths too: an identifier says what the asset is
called where it came from, and nothing opens it.
"""

from collections.abc import Iterable

from pxr import Sdf, UsdUtils

from spin_usd.stage.usd.layer_file import layer_at

DESCRIPTIONS = ("assetInfo", "customData", "customLayerData")


def named_assets(identifier: str) -> list[str]:
    """List every asset path authored in the layer, descriptions included."""
    return [name for kind in UsdUtils.ExtractExternalReferences(identifier) for name in kind]


def opened_assets(identifier: str, names: Iterable[str]) -> list[str]:
    """Select those of `names` that the layer names outside descriptions: in arcs, clips and values."""
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
