"""A body in Blender: one mesh for each shape, and an object for each place it stands in; faces are numbered."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import bpy
import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.renderers.blender.cycles.assign import assign, assign_matrix
from spin_usd.renderers.blender.cycles.light_groups import EMISSION
from spin_usd.renderers.blender.materials.material import FIRST_NUMBER, MaterialLibrary
from spin_usd.renderers.blender.shape import build_mesh
from spin_usd.renderers.blender.shared_mesh import shared_meshes
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh


class TargetObject:
    """A target or an occluder in Blender: its meshes, materials and pose."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self.axes: Any = bpy.data.objects.new("body", None)
        """What all of it stands in: the body's axes around the target's centre."""
        self.axes.parent = bpy.data.objects.new("pose", None)
        self._data: list[Any] = []
        self._shown: list[Any] = []
        self._objects: dict[int, list[Any]] = {}
        self._mesh: Mesh | None = None
        self._primvars: frozenset[str] = frozenset()
        self._split = False
        self._bare = True
        self._camera_sees, self._hidden = True, False
        self._materials = MaterialLibrary()

    def show(self, mesh: Mesh, R_cam_body: Float, location: Float, *, split: bool, primvars: frozenset[str]) -> None:
        """Make Blender's target `mesh`, with this attitude, its centre at `location` (3,) metres; `split` into face
        groups. It has at least these of the mesh's `primvars`."""
        if mesh is not self._mesh or split != self._split or not primvars <= self._primvars:
            self._primvars = primvars | self._primvars if mesh is self._mesh else primvars
            self._replace(mesh, split=split)
            self._mesh, self._split, self._bare = mesh, split, True
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
            for shown in self._shown:
                assign(shown, {"hide_render": hidden})
            self._hidden = hidden

    def dress(self, authored: Sequence[Material], needed: Sequence[Material], *, emissive_lights: bool) -> None:
        """Give it the materials that are `needed` of those `authored`; `emissive_lights`: rays look for emissive faces.
        Raises UnsupportedError; what only labels need stays visible without."""
        self._fill(partial(self._materials.dress, needed=needed, emissive_lights=emissive_lights), authored)

    def number(self, materials: Sequence[Material]) -> None:
        """Let its faces emit their numbers, where its materials do not cut them out."""
        self._fill(self._materials.number, materials)

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

    def _replace(self, mesh: Mesh, *, split: bool) -> None:
        """Show another mesh, in the objects that there are as far as they go; free the rest of the one before."""
        stale, unused = self._data, iter(self._shown)
        self._data, self._shown, self._objects = [], [], {}
        for shared in shared_meshes(mesh, split=split):
            data = build_mesh(shared.shape, shared.centre, shared.chosen, self._primvars)
            self._data.append(data)
            for copy in shared.copies:
                shown = next(unused, None) or self._new(data)
                shown.data, shown[FIRST_NUMBER] = data, float(copy.first)
                assign_matrix(shown, copy.matrix)
                self._shown.append(shown)
                self._objects.setdefault(copy.group, []).append(shown)
        for shown in unused:
            bpy.data.objects.remove(shown)
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
