"""A layer added to a written stage: prims of the root layer refer to it before all their other references."""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf

from spin_usd.stage.composition.open_layer import open_layer
from spin_usd.stage.usd.layer_file import export, writing

FOLDER = "layers"


def add_layer(root: Path, layer: Sdf.Layer, file: str, prims: Mapping[Sdf.Path, Sdf.Path]) -> None:
    """Write `layer` as `file` beside the other layers of the stage at `root`, and let each of the root layer's
    `prims` refer to the prim of `layer` that it maps to.

    The layer is referenced, so a variant on the default prim beats it. Raises OutputError.
    """
    export(layer, root.parent / FOLDER / file)
    made = open_layer(root)
    for prim, source in prims.items():
        references = Sdf.CreatePrimInLayer(made, prim).referenceList.prependedItems
        references.insert(0, Sdf.Reference(f"./{FOLDER}/{file}", source))
    with writing(root):
        made.Save()
