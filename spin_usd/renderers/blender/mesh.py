"""A body in Blender: one mesh for each shape, and an object for each place it stands in; faces are numbered."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import RenderError
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.renderers.blender.light_links import EMISSION
from spin_usd.renderers.blender.material import FACE_NUMBER, FIRST_NUMBER, MaterialLibrary
from spin_usd.renderers.blender.nodes import assign, assign_matrix
from spin_usd.renderers.blender.textures import attribute_name
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import Shape

# A primvar's kind of attribute by its number of components, and the property that holds its values.
STORAGE = {1: ("FLOAT", "value"), 2: ("FLOAT2", "vector"), 3: ("FLOAT_VECTOR", "vector"), 4: ("FLOAT_COLOR", "color")}
Faces = NDArray[np.intp] | slice
EVERY = slice(None)
# Volumes are left, and there are none here: an object that no kind of ray sees would be none to Cycles.
UNSEEN = {f"visible_{rays}": False for rays in ("camera", "diffuse", "glossy", "transmission", "shadow")}


class TargetObject:
    """A target or an occluder in Blender: its meshes, materials and pose."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self.axes: Any = bpy.data.objects.new("body", None)
        """Parent of all of it: the body's axes around the target's centre."""
        self.axes.parent = bpy.data.objects.new("pose", None)
        self._data: list[Any] = []
        self._shown: list[Any] = []
        self._twins: list[Any] = []
        self._objects: dict[int, list[Any]] = {}
        self._mesh: Mesh | None = None
        self._split = self._glows = False
        self._bare = True
        self._camera_sees, self._hidden = True, False
        self._materials = MaterialLibrary()

    def show(self, mesh: Mesh, R_cam_body: Float, location: Float, *, split: bool, glows: bool) -> None:
        """Make Blender's target `mesh`, with this attitude, its centre at `location` (3,) metres; `split` into face
        groups. `glows`: a material of it may emit light."""
        if mesh is not self._mesh or (split, glows) != (self._split, self._glows):
            self._replace(mesh, split=split, twins=not glows)
            self._mesh, self._split, self._glows, self._bare = mesh, split, glows, True
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = T_USDCAM_CAM.rotation @ R_cam_body, location
        assign_matrix(self.axes, matrix)

    def show_camera(self, seen: bool) -> None:
        """Let cameras see it, or look through it; it stays in Blender's scene, which hiding would prepare anew."""
        if seen != self._camera_sees:
            for shown in self._shown:
                assign(shown, {"visible_camera": seen})
            self._camera_sees = seen

    def hide(self, hidden: bool) -> None:
        """Take it out of all renders, or put it back."""
        if hidden != self._hidden:
            for each in (*self._shown, *self._twins):
                assign(each, {"hide_render": hidden})
            self._hidden = hidden

    def set_materials(self, materials: Sequence[Material]) -> None:
        """Give it these materials. Raises UnsupportedError; faces only for labels stay visible without."""
        self._fill(self._materials.set_materials, materials)

    def show_face_ids(self, materials: Sequence[Material]) -> None:
        """Let its faces emit their numbers, where its materials do not cut them out."""
        self._fill(self._materials.show_face_ids, materials)

    def _fill(self, fill: Callable[..., None], materials: Sequence[Material]) -> None:
        assert self._mesh is not None
        fill(self._data, materials, self._mesh, again=self._bare)
        self._bare = False

    @property
    def objects(self) -> Sequence[Any]:
        """All that show it."""
        return self._shown

    @property
    def groups(self) -> Mapping[int, Sequence[Any]]:
        """The objects of each face group; where it is not split, all as group 0."""
        return self._objects

    def _replace(self, mesh: Mesh, *, split: bool, twins: bool) -> None:
        """Show another mesh, in the objects that there are as far as they go; free the rest of the one before."""
        stale, unused = self._data, (iter(self._shown), iter(self._twins))
        self._data, self._shown, self._twins, self._objects = [], [], [], {}
        for shared in shared_meshes(mesh, split=split):
            data = build_mesh(shared.shape, shared.centre, shared.chosen)
            self._data.append(data)
            for copy in shared.copies:
                shown = next(unused[0], None) or self._new(data)
                shown.data, shown[FIRST_NUMBER] = data, float(copy.first)
                assign_matrix(shown, copy.matrix)
                self._shown.append(shown)
                self._objects.setdefault(copy.group, []).append(shown)
            if twins and len(shared.copies) == 1:
                twin = next(unused[1], None) or self._new_twin(data)
                twin.data = data
                self._twins.append(twin)
        for each in chain(*unused):
            bpy.data.objects.remove(each)
        for data in stale:
            bpy.data.meshes.remove(data)

    def _new(self, data: Any) -> Any:
        shown = bpy.data.objects.new("target", data)
        shown.parent = self.axes
        assign(shown, {"lightgroup": EMISSION})
        if not self._camera_sees or self._hidden:
            assign(shown, {"visible_camera": self._camera_sees, "hide_render": self._hidden})
        self._scene.collection.objects.link(shown)
        return shown

    def _new_twin(self, data: Any) -> Any:
        """Return one more object of a mesh, which no ray sees.

        Cycles moves the triangles of a mesh that one object alone shows into the world's axes, and builds its tree of
        boxes there. A spacecraft is made of boxes and panels along its own axes: there the tree's boxes are tighter, so
        that rays find their triangles sooner, and another pose needs neither mesh nor tree anew. Where faces glow there
        is none, for what no ray sees is a source of light all the same. It lies at the world's origin, unturned, and is
        not to be seen in a viewport.
        """
        twin = bpy.data.objects.new("twin", data)
        assign(twin, {**UNSEEN, "hide_viewport": True, "hide_render": self._hidden})
        self._scene.collection.objects.link(twin)
        return twin


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshCopy:
    """One object of a shared mesh."""

    matrix: Float
    """(4, 4) from its axes around its centre to the body's around the target's, metres."""
    group: int = 0
    """Group of its faces, 0 if not needed."""
    first: int = 0
    """How many faces are numbered before its own."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SharedMesh:
    """The `chosen` faces of `shape`, metres from `centre`, and the objects that show them."""

    shape: Shape
    centre: Float
    copies: tuple[MeshCopy, ...]
    chosen: Faces = EVERY


def shared_meshes(mesh: Mesh, *, split: bool) -> Iterator[SharedMesh]:
    """Yield all of `mesh`; `split` by face groups."""
    if len(mesh.faces) and not split:
        yield SharedMesh(shape=mesh, centre=mesh.centre, copies=(MeshCopy(matrix=np.eye(4)),))
    elif len(mesh.faces):
        of_face = np.asarray(mesh.face_group)
        for group in np.unique(of_face):
            copy = MeshCopy(matrix=np.eye(4), group=int(group))
            yield SharedMesh(shape=mesh, centre=mesh.centre, copies=(copy,), chosen=np.flatnonzero(of_face == group))
    for first, each in mesh.numbered:
        used = each.shape.used_points
        centre = (used.min(0) + used.max(0)) / 2
        copies = []
        for number, (linear, group) in enumerate(zip(each.matrices[..., :3], each.groups, strict=True)):
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:3, 3] = linear, each.moved(centre, number) - mesh.centre
            before = first + number * len(each.shape.faces)
            copies.append(MeshCopy(matrix=matrix, group=int(group) if split else 0, first=before))
        yield SharedMesh(shape=each.shape, centre=centre, copies=tuple(copies))


def build_mesh(shape: Shape, centre: Float, chosen: Faces) -> Any:
    """Return a Blender mesh of the `chosen` faces of `shape`, metres from `centre`, each with three vertices of its
    own, and of its primvars.

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
    for name in sorted(shape.primvars):
        values = shape.primvars[name]
        kind, holder = STORAGE[values.shape[2]]
        attribute = data.attributes.new(attribute_name(name), kind, "CORNER")  # of two components: a UV map
        attribute.data.foreach_set(holder, values[chosen].ravel())
    data.update(calc_edges=True)
    if data.validate():
        raise RenderError("Blender repaired the target's mesh, so its faces no longer match the labels")
    _set_normals(data, shape, chosen)
    return data


def _number_faces(data: Any, numbers: NDArray[np.float32]) -> None:
    data.attributes.new(FACE_NUMBER, "FLOAT", "FACE").data.foreach_set("value", numbers)


def _set_normals(data: Any, shape: Shape, chosen: Faces) -> None:
    """Shade by the corner normals; flat where they equal the faces' own."""
    smooth = shape.smooth[chosen]
    data.polygons.foreach_set("use_smooth", smooth)
    if smooth.any():
        normals = data.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        normals.data.foreach_set("vector", shape.corner_normals[chosen].ravel())
