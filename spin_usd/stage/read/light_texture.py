"""The image that a rectangle or a dome emits."""

from pxr import Sdf, Usd

from spin_usd.errors import UnsupportedError
from spin_usd.scene.texture import Image
from spin_usd.stage.composition.images import Images
from spin_usd.stage.usd.values import read

FILE, FORMAT = "inputs:texture:file", "inputs:texture:format"
LATLONG = ("automatic", "latlong")


def read_texture(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> Image | None:
    """Read the image in linear colours; the file's own colour space decides. Raises StageError, UnsupportedError."""
    attribute = prim.GetAttribute(FILE)
    asset: Sdf.AssetPath | None = read(attribute, time) if attribute else None
    if asset is None or not asset.path:
        return None
    layout = prim.GetAttribute(FORMAT)
    if layout and read(layout, time) not in LATLONG:
        found = f"its texture is a {read(layout, time)}"
        raise UnsupportedError(found, where=prim.GetPath(), do="convert it to latitude and longitude")
    return images.read(asset, "auto", prim).image
