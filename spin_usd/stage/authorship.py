"""Who made a stage, from what: UsdMedia's AuthorshipAPI for everybody, customLayerData for ourselves.

No clock is read: the same inputs give the same bytes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pxr import Sdf, Usd, UsdMedia

from spin_usd import __version__
from spin_usd.stage import schema

INSTANCE = "author"
# The IPTC's word for a picture made by an algorithm without training on samples.
DIGITAL_SOURCE_TYPE = "http://cv.iptc.org/newscodes/digitalsourcetype/algorithmicMedia"


@dataclass(frozen=True, kw_only=True)
class Origin:
    """inputs maps what it is (poses, target, camera) to (file or built-in name, sha256); numbers maps what else decides
    what is made of them (seed, units_per_metre)."""

    inputs: Mapping[str, tuple[str, str]]
    numbers: Mapping[str, float] = field(default_factory=dict)


def author_origin(layer: Sdf.Layer, prim: Usd.Prim, origin: Origin) -> None:
    """Record `origin` on a root layer and on its default prim."""
    data = dict(layer.customLayerData)
    data[schema.PROVENANCE] = {
        "version": __version__,
        "inputs": {role: {"name": name, "sha256": sha256} for role, (name, sha256) in origin.inputs.items()},
        "numbers": {name: repr(value) for name, value in origin.numbers.items()},
    }
    layer.customLayerData = data
    api = UsdMedia.AuthorshipAPI.Apply(prim, INSTANCE)
    api.CreateSoftwarePackageAttr("spin_usd")
    api.CreateSoftwareVersionAttr(__version__)
    api.CreateDigitalSourceTypeAttr(DIGITAL_SOURCE_TYPE)
    pairs = [(f"{role} {name}", f"sha256:{sha256}") for role, (name, sha256) in sorted(origin.inputs.items())]
    api.CreateInputsAttr([text for pair in pairs for text in pair])


def origin_of(stage: Usd.Stage) -> dict[str, str]:
    """What the stage was authored from, by what it is, as text that differs where that does; of a stage that `author`
    did not make, the name of its root layer."""
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        data = layer.customLayerData.get(schema.PROVENANCE)
        parts = [data.get(name) for name in ("inputs", "numbers")] if isinstance(data, dict) else []
        found = {name: str(value) for part in parts if isinstance(part, dict) for name, value in part.items()}
        if found:
            return found
    return {"root": Path(stage.GetRootLayer().realPath).name}
