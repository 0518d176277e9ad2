"""KHR_draco_mesh_compression: a primitive's numbers out of one compressed buffer view, by Google's own decoder.

Source: the extension's text. Its attributes are found by their unique ids; the accessors' own buffers, where there are
any, are a fallback for readers without a decoder. Strips are given as triangles.
"""

from collections.abc import Mapping
from typing import Any

import DracoPy
import numpy as np
from numpy.typing import NDArray

from spin_usd.formats.mesh.gltf_document import Document

DRACO = "KHR_draco_mesh_compression"


def decompressed(document: Document, primitive: Mapping[str, Any]) -> tuple[Mapping[str, Any], dict[int, NDArray[Any]]]:
    """Return the primitive as triangles, and what stands for its accessors by their indices: nothing where it is not
    compressed. Raises any built-in error for damaged data."""
    said = primitive.get("extensions", {}).get(DRACO)
    if said is None:
        return primitive, {}
    mesh = DracoPy.decode(document.view(said["bufferView"]))
    by_id = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
    found = {primitive["attributes"][name]: by_id[number] for name, number in said["attributes"].items()}
    if "indices" not in primitive:
        raise ValueError("a compressed primitive has no indices")
    found[primitive["indices"]] = np.asarray(mesh.faces).reshape(-1, 1)
    return {**primitive, "mode": 4}, found
