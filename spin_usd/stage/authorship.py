"""Who made a stage, from what: UsdMedia's AuthorshipAPI for everybody, customLayerData for ourselves.

No clock is read: the same inputs give the same bytes.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from pxr import Sdf, Usd, UsdMedia

from spin_usd import __version__
from spin_usd.stage import schema

INSTANCE = "author"
# The IPTC's word for a picture made by an algorithm without training on samples.
DIGITAL_SOURCE_TYPE = "http://cv.iptc.org/newscodes/digitalsourcetype/algorithmicMedia"


@dataclass(frozen=True, kw_only=True)
class Origin:
    """inputs maps what it is (poses, target, camera) to (file or built-in name, sha256)."""

    inputs: Mapping[str, tuple[str, str]]


def author_origin(layer: Sdf.Layer, prim: Usd.Prim, origin: Origin) -> None:
    """Record `origin` on a root layer and on its default prim."""
    data = dict(layer.customLayerData)
    data[schema.PROVENANCE] = {
        "version": __version__,
        "inputs": {role: {"name": name, "sha256": sha256} for role, (name, sha256) in origin.inputs.items()},
    }
    layer.customLayerData = data
    api = UsdMedia.AuthorshipAPI.Apply(prim, INSTANCE)
    api.CreateSoftwarePackageAttr("spin_usd")
    api.CreateSoftwareVersionAttr(__version__)
    api.CreateDigitalSourceTypeAttr(DIGITAL_SOURCE_TYPE)
    pairs = [(f"{role} {name}", f"sha256:{sha256}") for role, (name, sha256) in sorted(origin.inputs.items())]
    api.CreateInputsAttr([text for pair in pairs for text in pair])
