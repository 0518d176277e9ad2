"""A layer added to a stage that was written: prims of the root layer refer to it before all that they refer to."""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf

from spin_usd.stage.usd.layer_file import export, open_layer, writing

FOLDER = "layers"


def add_layer(root: Path, layer: Sdf.Layer, file: str, places: Mapping[Sdf.Path, Sdf.Path]) -> None:
    """Write `layer` as `file` beside the other layers of the stage at `root`, and let the prims `places` refer to the
    prims of it that they map to.

    It comes by reference, so a variant on the default prim beats it. Raises OutputError.
    """
    export(layer, root.parent / FOLDER / file)
    made = open_layer(root)
    for place, source in places.items():
        references = Sdf.CreatePrimInLayer(made, place).referenceList.prependedItems
        references.insert(0, Sdf.Reference(f"./{FOLDER}/{file}", source))
    with writing(root):
        made.Save()
