"""KHR_draco_mesh_compression: a primitive's numbers out of one compressed buffer view, by Google's own decoder.

Source: the extension's text. Its attributes are found by their unique ids; the accessors' own buffers, where there are
any, are a fallback for readers without a decoder. Strips are given as triangles.
"""

from typing import Any

import DracoPy
import numpy as np
from numpy.typing import NDArray

from spin_usd.faults import decoding
from spin_usd.formats.mesh.gltf_document import Document
from spin_usd.formats.mesh.gltf_json import JsonObject

DRACO = "KHR_draco_mesh_compression"


def decompressed(document: Document, primitive: JsonObject) -> dict[int, NDArray[Any]] | None:
    """Return what stands for the primitive's accessors by their indices, as triangles; None where it is not compressed.
    Raises InputError."""
    if DRACO not in primitive.object("extensions"):
        return None
    said = primitive.object("extensions").object(DRACO)
    data = bytes(document.view(said.whole("bufferView")))
    with decoding(f"{document.path}, {said.place}"):
        mesh = DracoPy.decode(data)
        by_id = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
        faces = np.asarray(mesh.faces).reshape(-1, 1)
    attributes, found = primitive.wholes_by_name("attributes"), {primitive.whole("indices"): faces}
    for name, number in said.wholes_by_name("attributes").items():
        if name not in attributes or number not in by_id:
            raise said.damaged(f"{said.place} has no {name} that the primitive has too")
        found[attributes[name]] = by_id[number]
    return found
