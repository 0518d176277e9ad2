"""The target in Blender: one mesh object, or one for each face group where lights are linked; faces are numbered."""

from collections.abc import Callable, Mapping, Sequence, Set
from functools import partial
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found]
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.errors import RenderError
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.render.blender.light_groups import EMISSION
from spin_usd.render.blender.material import FACE_NUMBER, MaterialLibrary
from spin_usd.render.blender.settings import assign
from spin_usd.render.blender.textures import attribute_name
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh

FLOAT32 = 2.0**-23  # relative rounding of what Blender stores
# A primvar's kind of attribute by its number of components, and the property that holds its values.
KINDS = {1: ("FLOAT", "value"), 2: ("FLOAT2", "vector"), 3: ("FLOAT_VECTOR", "vector"), 4: ("FLOAT_COLOR", "color")}
Faces = NDArray[np.intp] | slice
EVERY = slice(None)


def build_mesh(mesh: Mesh, chosen: Faces, primvars: Set[str]) -> Any:
    """A Blender mesh of the `chosen` faces of `mesh`, metres from its centre, each with three vertices of its own, and
    of those of its `primvars`.

    Unshared, so that no face is a duplicate to Blender, which would drop it, and shading normals belong to vertices.
    """
    corners = (mesh.points[mesh.faces[chosen]] - mesh.centre).astype(np.float32)
    count = len(corners)
    data = bpy.data.meshes.new("target")
    data.vertices.add(3 * count)
    data.vertices.foreach_set("co", corners.ravel())
    data.loops.add(3 * count)
    data.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    data.polygons.add(count)
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    data.polygons.foreach_set("material_index", mesh.face_material[chosen])
    _number_faces(data, np.arange(1, len(mesh.faces) + 1, dtype=np.float32)[chosen])
    for name in sorted(primvars & set(mesh.primvars)):
        values = mesh.primvars[name]
        kind, holder = KINDS[values.shape[2]]
        attribute = data.attributes.new(attribute_name(name), kind, "CORNER")  # of two components: a UV map
        attribute.data.foreach_set(holder, values[chosen].ravel())
    data.update(calc_edges=True)
    if data.validate():
        raise RenderError("Blender repaired the target's mesh, so its faces are no longer those of the labels")
    _set_normals(data, mesh, chosen)
    return data


def _number_faces(data: Any, numbers: NDArray[np.float32]) -> None:
    data.attributes.new(FACE_NUMBER, "FLOAT", "FACE").data.foreach_set("value", numbers)


def _set_normals(data: Any, mesh: Mesh, chosen: Faces) -> None:
    """Shade as the corner normals say; flat where they are the faces' own."""
    smooth = mesh.smooth[chosen]
    data.polygons.foreach_set("use_smooth", smooth)
    if smooth.any():
        normals = data.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        normals.data.foreach_set("vector", mesh.corner_normals[chosen].ravel())


class TargetObject:
    """What Blender shows of the target: mesh, materials and pose. One object, or one for each face group."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._axes = bpy.data.objects.new("pose", None)
        self._objects: dict[int, Any] = {}
        self._mesh: Mesh | None = None
        self._primvars: frozenset[str] = frozenset()
        self._split = False
        self._bare = True
        self._materials = MaterialLibrary()

    def show(self, mesh: Mesh, R_cam_body: Float, location: Float, *, split: bool, primvars: frozenset[str]) -> None:
        """Make Blender's target `mesh`, so turned, its centre at `location` (3,) metres; `split` into face groups. It
        has at least these of the mesh's `primvars`."""
        if mesh is not self._mesh or split != self._split or not primvars <= self._primvars:
            self._primvars = primvars | self._primvars if mesh is self._mesh else primvars
            self._replace(_pieces(mesh) if split else {0: EVERY}, mesh)
            self._mesh, self._split, self._bare = mesh, split, True
        for shown in self._objects.values():
            _pose(shown, R_cam_body, location)

    def dress(self, authored: Sequence[Material], needed: Sequence[Material], *, glowing_lights: bool) -> None:
        """Give it the materials that are `needed` of those `authored`; `glowing_lights`: rays look for those that glow.
        Raises UnsupportedError; what only labels need stays visible without."""
        self._fill(partial(self._materials.dress, needed=needed, glowing_lights=glowing_lights), authored)

    def number(self, materials: Sequence[Material]) -> None:
        """Let it glow with its faces' numbers, where its materials do not cut it out."""
        self._fill(self._materials.number, materials)

    def _fill(self, fill: Callable[..., None], materials: Sequence[Material]) -> None:
        assert self._mesh is not None
        fill([shown.data for shown in self._objects.values()], materials, self._mesh, again=self._bare)
        self._bare = False

    @property
    def groups(self) -> Mapping[int, Any]:
        """The object of each face group; where it is not split, the whole as group 0."""
        return self._objects

    def _replace(self, pieces: Mapping[int, Faces], mesh: Mesh) -> None:
        """Show other meshes, and free those before."""
        for group in set(self._objects) - set(pieces):
            bpy.data.meshes.remove(self._objects.pop(group).data)  # and with it the object
        for group, chosen in pieces.items():
            data = build_mesh(mesh, chosen, self._primvars)
            if group in self._objects:
                before, self._objects[group].data = self._objects[group].data, data
                bpy.data.meshes.remove(before)
            else:
                shown = self._objects[group] = bpy.data.objects.new("target", data)
                shown.parent = self._axes
                assign(shown, {"lightgroup": EMISSION})
                self._scene.collection.objects.link(shown)


def _pieces(mesh: Mesh) -> dict[int, Faces]:
    """The faces of each group."""
    of_face = np.asarray(mesh.face_group)
    return {int(group): np.flatnonzero(of_face == group) for group in np.unique(of_face)}


def _pose(shown: Any, R_cam_body: Float, location: Float) -> None:
    """Rotate and move an object.

    The matrix goes through the parent's inverse, which keeps each entry to float32's rounding; through a
    quaternion it was up to 17 times less exact.
    """
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = T_USDCAM_CAM.rotation @ R_cam_body, location
    shown.matrix_parent_inverse = Matrix(matrix)
    if not np.allclose(np.array(shown.matrix_parent_inverse), matrix, rtol=FLOAT32, atol=FLOAT32):
        raise RenderError("Blender changed the target's pose")
