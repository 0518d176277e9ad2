"""One shape as a Blender mesh; its faces are numbered."""

from collections.abc import Set
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.errors import RenderError
from spin_usd.renderers.blender.materials.material import FACE_NUMBER
from spin_usd.renderers.blender.materials.textures import attribute_name
from spin_usd.scene.shape import Shape

# A primvar's kind of attribute by its number of components, and the property that holds its values.
KINDS = {1: ("FLOAT", "value"), 2: ("FLOAT2", "vector"), 3: ("FLOAT_VECTOR", "vector"), 4: ("FLOAT_COLOR", "color")}
Faces = NDArray[np.intp] | slice
EVERY = slice(None)


def build_mesh(shape: Shape, centre: Float, chosen: Faces, primvars: Set[str]) -> Any:
    """Return a Blender mesh of the `chosen` faces of `shape`, metres from `centre`, each with three vertices of its
    own, and of those of its `primvars`.

    Unshared, so that no face is a duplicate to Blender, which would drop it, and shading normals belong to vertices.
    """
    corners = (shape.points[shape.faces[chosen]] - centre).astype(np.float32)
    count = len(corners)
    data = bpy.data.meshes.new("target")
    data.vertices.add(3 * count)
    data.vertices.foreach_set("co", corners.ravel())
    data.loops.add(3 * count)
    data.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    data.polygons.add(count)
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    data.polygons.foreach_set("material_index", shape.face_material[chosen])
    _number_faces(data, np.arange(1, len(shape.faces) + 1, dtype=np.float32)[chosen])
    for name in sorted(primvars & set(shape.primvars)):
        values = shape.primvars[name]
        kind, holder = KINDS[values.shape[2]]
        attribute = data.attributes.new(attribute_name(name), kind, "CORNER")  # of two components: a UV map
        attribute.data.foreach_set(holder, values[chosen].ravel())
    data.update(calc_edges=True)
    if data.validate():
        raise RenderError("Blender repaired the target's mesh, so its faces are no longer those of the labels")
    _set_normals(data, shape, chosen)
    return data


def _number_faces(data: Any, numbers: NDArray[np.float32]) -> None:
    data.attributes.new(FACE_NUMBER, "FLOAT", "FACE").data.foreach_set("value", numbers)


def _set_normals(data: Any, shape: Shape, chosen: Faces) -> None:
    """Shade as the corner normals say; flat where they are the faces' own."""
    smooth = shape.smooth[chosen]
    data.polygons.foreach_set("use_smooth", smooth)
    if smooth.any():
        normals = data.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        normals.data.foreach_set("vector", shape.corner_normals[chosen].ravel())
