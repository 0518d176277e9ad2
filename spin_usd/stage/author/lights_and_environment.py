"""Surroundings: layers of a stage's lights, and of its background.

Those that travel with spin_usd lie in `stages/environments`; a user may give others. The default prim of a layer of
lights is Lights, that of an environment is Environment.
"""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf

from spin_usd.errors import InputError
from spin_usd.stage.author.paths import ENVIRONMENT, LIGHTS
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.usd.layer_file import author_metadata

KINDS: Mapping[str, Sdf.Path] = {"lights": LIGHTS, "environment": ENVIRONMENT}
"""The kinds of surroundings, and where an authored stage has them."""
USUAL: Mapping[str, str] = {"lights": "sun", "environment": "deep_space"}
"""The layer of each kind that a stage has unless another is chosen."""


def open_surroundings(path: str | Path, kind: str) -> Sdf.Layer:
    """Flatten the layer at `path` into one anonymous layer, asset paths absolute.

    Raises InputError that names the file where it is not of that kind.
    """
    layer = open_layer(Path(path))
    flat = composed(layer, path)
    prim = KINDS[kind].name
    if layer.defaultPrim != prim or not flat.GetPrimAtPath(f"/{prim}"):
        what = "layer of lights" if kind == "lights" else "layer of an environment"
        raise InputError(f"is not a {what}: its default prim is not {prim}", where=path)
    return extracted(flat, Sdf.Path(f"/{prim}"), layer.documentation)


def composed(layer: Sdf.Layer, path: str | Path) -> Sdf.Layer:
    """Flatten the layer at `path` with all that it references. Raises InputError where it does not compose."""
    stage = stage_on(layer)
    if errors := stage.GetCompositionErrors():
        raise InputError(f"does not compose: {errors[0]}", where=path)
    return stage.Flatten(addSourceFileComment=False)


def extracted(flat: Sdf.Layer, prim: Sdf.Path, documentation: str) -> Sdf.Layer:
    """Copy `prim` and all below it into a layer of its own."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=prim.name, documentation=documentation)
    Sdf.CopySpec(flat, prim, layer, Sdf.Path.absoluteRootPath.AppendChild(prim.name))
    return layer
