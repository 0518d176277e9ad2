"""Sets of image tiles: asset paths with <UDIM> in place of each tile's number.

Source: the UsdPreviewSurface specification, version 2.6, and MaterialX 1.38 for the numbers: 1001 is the unit square at
the origin of the texture coordinates, 1002 the one to its right, 1011 the one above it.
"""

from typing import Any

from pxr import Sdf, Usd, UsdShade

UDIM = "<UDIM>"
FIRST, IN_A_ROW = 1001, 10


def is_tiled(asset: Sdf.AssetPath) -> bool:
    """Return whether the asset path names a set of tiles."""
    return UDIM in asset.path


def resolved_tiles(attribute: Usd.Attribute, value: Any) -> Any:
    """Return `value` of `attribute`, resolved if it is an asset path to tiles, which USD resolves only against a given
    layer. The resolved path still contains <UDIM>, and is empty if there is no tile."""
    if not isinstance(value, Sdf.AssetPath) or not is_tiled(value) or value.resolvedPath:
        return value
    layer = attribute.GetPropertyStack(Usd.TimeCode.Default())[0].layer
    return Sdf.AssetPath(value.path, UsdShade.UdimUtils.ResolveUdimPath(value.path, layer))


def tiles_of(asset: Sdf.AssetPath) -> list[tuple[tuple[int, int], Sdf.AssetPath]]:
    """List the (column, row) of each tile of a resolved set, and its own path, in order of their numbers."""
    found = UsdShade.UdimUtils.ResolveUdimTilePaths(asset.resolvedPath, None)
    tiles = sorted((int(number) - FIRST, asset.path.replace(UDIM, number), path) for path, number in found)
    return [((n % IN_A_ROW, n // IN_A_ROW), Sdf.AssetPath(own, path)) for n, own, path in tiles]
