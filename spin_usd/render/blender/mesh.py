"""The target in Blender: one mesh object, its faces numbered."""

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found]
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.errors import RenderError
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.render.blender.material import FACE_NUMBER, MaterialLibrary
from spin_usd.scene.material import Material
from spin_usd.scene.model import Mesh

FLAT = 1e-3  # corner normals this near the face's own are a flat face's
FLOAT32 = 2.0**-23  # relative rounding of what Blender stores


def build_mesh(mesh: Mesh) -> Any:
    """A Blender mesh of `mesh`, metres from its centre, each triangle with three vertices of its own.

    Unshared, so that no face is a duplicate to Blender, which would drop it, and shading normals belong to vertices.
    """
    corners = (mesh.points[mesh.faces] - mesh.centre).astype(np.float32)
    count = len(corners)
    data = bpy.data.meshes.new("target")
    data.vertices.add(3 * count)
    data.vertices.foreach_set("co", corners.ravel())
    data.loops.add(3 * count)
    data.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    data.polygons.add(count)
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    data.polygons.foreach_set("material_index", mesh.face_material)
    _number_faces(data, count)
    data.update(calc_edges=True)
    if data.validate():
        raise RenderError("Blender repaired the target's mesh, so its faces are no longer those of the labels")
    _set_normals(data, mesh)
    return data


def _number_faces(data: Any, count: int) -> None:
    numbers = np.arange(1, count + 1, dtype=np.float32)
    data.attributes.new(FACE_NUMBER, "FLOAT", "FACE").data.foreach_set("value", numbers)


def _set_normals(data: Any, mesh: Mesh) -> None:
    """Shade as the corner normals say; flat where they are the faces' own."""
    smooth = _smooth_faces(mesh)
    data.polygons.foreach_set("use_smooth", smooth)
    if smooth.any():
        normals = data.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        normals.data.foreach_set("vector", mesh.corner_normals.ravel())


def _smooth_faces(mesh: Mesh) -> NDArray[np.bool_]:
    """(F,) whether a face's corner normals differ from its own normal."""
    a, b, c = np.moveaxis(mesh.points[mesh.faces], 1, 0)
    normal: Float = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    return np.abs(mesh.corner_normals - normal[:, None]).max((1, 2)) > FLAT


class TargetObject:
    """The one object that Blender shows: mesh, materials and pose."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._object: Any = None
        self._mesh: Mesh | None = None
        self._bare = True
        self._materials = MaterialLibrary()

    def show(self, mesh: Mesh, R_cam_body: Float, location: Float) -> None:
        """Make Blender's target `mesh`, so turned, its centre at `location` (3,) metres."""
        if mesh is not self._mesh:
            self._replace(build_mesh(mesh))
            self._mesh, self._bare = mesh, True
        self._pose(R_cam_body, location)

    def dress(self, materials: Sequence[Material]) -> None:
        """Give it its materials. Raises UnsupportedError; what only labels need stays visible without."""
        self._materials.assign(self._object.data, materials, again=self._bare)
        self._bare = False

    @property
    def emissive(self) -> bool:
        return self._materials.emissive

    @property
    def transparent(self) -> bool:
        return self._materials.transparent

    def _replace(self, data: Any) -> None:
        """Show another mesh, and free the one before."""
        if self._object is None:
            self._object = bpy.data.objects.new("target", data)
            self._object.parent = bpy.data.objects.new("pose", None)
            self._scene.collection.objects.link(self._object)
            return
        before, self._object.data = self._object.data, data
        bpy.data.meshes.remove(before)

    def _pose(self, R_cam_body: Float, location: Float) -> None:
        """Rotate and move the object.

        The matrix goes through the parent's inverse, which keeps each entry to float32's rounding; through a
        quaternion it was up to 17 times less exact.
        """
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = T_USDCAM_CAM.rotation @ R_cam_body, location
        self._object.matrix_parent_inverse = Matrix(matrix)
        if not np.allclose(np.array(self._object.matrix_parent_inverse), matrix, rtol=FLOAT32, atol=FLOAT32):
            raise RenderError("Blender changed the target's pose")
