"""The origin of a stage: UsdMedia's AuthorshipAPI for other programs, customLayerData for ourselves.

No clock is read: the same inputs give the same bytes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Usd, UsdMedia

from spin_usd import __version__
from spin_usd.stage.usd import schema

INSTANCE = "author"
# The IPTC's term for an image made by an algorithm without training on samples.
DIGITAL_SOURCE_TYPE = "http://cv.iptc.org/newscodes/digitalsourcetype/algorithmicMedia"


Option = str | int | float | tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Origin:
    """The inputs and options from which a stage was authored. inputs: role (poses, target, camera) -> (file or built-in
    name, sha256) · options: name (seed, units_per_metre, sun_direction) -> text, a number or three."""

    inputs: Mapping[str, tuple[str, str]]
    options: Mapping[str, Option] = field(default_factory=dict)


def author_origin(layer: Sdf.Layer, prim: Usd.Prim, origin: Origin) -> None:
    """Record `origin` on a root layer and on its default prim."""
    data = dict(layer.customLayerData)
    data[schema.PROVENANCE] = {
        "version": __version__,
        "inputs": {role: {"name": name, "sha256": sha256} for role, (name, sha256) in origin.inputs.items()},
        "options": {name: _as_usd(value) for name, value in origin.options.items()},
    }
    layer.customLayerData = data
    api = UsdMedia.AuthorshipAPI.Apply(prim, INSTANCE)
    api.CreateSoftwarePackageAttr("spin_usd")
    api.CreateSoftwareVersionAttr(__version__)
    api.CreateDigitalSourceTypeAttr(DIGITAL_SOURCE_TYPE)
    pairs = [(f"{role} {name}", f"sha256:{sha256}") for role, (name, sha256) in sorted(origin.inputs.items())]
    api.CreateInputsAttr([text for pair in pairs for text in pair])


def origin_of(stage: Usd.Stage) -> dict[str, Any]:
    """Return the stage's origin as JSON: "inputs", each with its name and sha256, and "options"; for a stage that
    `author` did not make, "root": the name of its root layer."""
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        data = layer.customLayerData.get(schema.PROVENANCE)
        inputs, options = ((data.get(name) if isinstance(data, dict) else None) for name in ("inputs", "options"))
        if isinstance(inputs, dict):
            return {
                "inputs": {role: _file(each) for role, each in inputs.items() if isinstance(each, dict)},
                "options": {name: _as_json(each) for name, each in (options or {}).items()},
            }
    return {"root": Path(stage.GetRootLayer().realPath).name}


def _file(each: Mapping[str, Any]) -> dict[str, str]:
    return {name: str(each.get(name, "")) for name in ("name", "sha256")}


def _as_usd(option: Option) -> Any:
    return Gf.Vec3d(*option) if isinstance(option, tuple) else option


def _as_json(option: Any) -> Any:
    """Return the option as JSON; as text where `author` does not write its type: a user may have edited it."""
    if isinstance(option, Gf.Vec3d):
        return list(option)
    return option if type(option) in (str, int, float) else str(option)
