"""The bodies of a picture as Blender's objects, which are kept from picture to picture."""

from collections.abc import Mapping, Sequence
from typing import Any

from spin_usd.renderers.blender.mesh import TargetObject
from spin_usd.renderers.blender.motion import MotionSetup
from spin_usd.renderers.camera_shader import View
from spin_usd.scene.derived.light_groups import emits
from spin_usd.scene.material import Material
from spin_usd.scene.scene import OneBody, Scene


class BodySetup:
    """The bodies of one Blender scene, in the order of Scene.bodies. A body keeps its objects from picture to picture,
    so that only changes are prepared anew."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._objects: list[TargetObject] = []
        self._motions: list[MotionSetup] = []
        self.count = 0
        """How many bodies there are."""

    def show_alone(self, place: int, scene: OneBody, view: View, *, split: bool) -> None:
        """Show cameras the body at `place` and no other; `scene` is the one with it alone."""
        self._make(place + 1)
        for motion in self._motions:
            motion.hold()
        self._place(place, scene, view, split=split)
        for number, objects in enumerate(self._objects):
            objects.show_camera(number == place)
        self._objects[place].hide(False)  # a picture of fewer bodies may have been before

    def show(self, scene: Scene, view: View, *, split: bool) -> None:
        """Show all bodies of `scene`, as its shutter sees them."""
        self.count = len(scene.one_body_scenes)
        self._make(self.count)
        for place, one in enumerate(scene.one_body_scenes):
            self._place(place, one, view, split=split)
            self._motions[place].move(self._objects[place].axes, self._objects[place].objects, one)
            self._objects[place].show_camera(True)
        for number, objects in enumerate(self._objects):
            objects.hide(number >= self.count)

    def set_materials(self, scene: Scene) -> None:
        """Give each body of `scene` its materials."""
        for body, objects in zip(scene.bodies, self._objects, strict=False):
            objects.set_materials(body.target.materials)

    def show_face_ids(self, place: int, materials: Sequence[Material]) -> None:
        """Let the faces of the body at `place` emit their numbers, where its materials do not cut them out."""
        self._objects[place].show_face_ids(materials)

    @property
    def axes(self) -> list[Any]:
        """The objects that hold the axes of each body, around its centre."""
        return [objects.axes for objects in self._objects[: self.count]]

    @property
    def groups(self) -> Mapping[int, Sequence[Any]]:
        """The objects of each face group; where bodies are not split, all as group 0."""
        found: dict[int, list[Any]] = {}
        for objects in self._objects[: self.count]:
            for group, shown in objects.groups.items():
                found.setdefault(group, []).extend(shown)
        return found

    def _make(self, count: int) -> None:
        while len(self._objects) < count:
            self._objects.append(TargetObject(self._scene))
            self._motions.append(MotionSetup(self._scene))

    def _place(self, place: int, scene: OneBody, view: View, *, split: bool) -> None:
        mesh, pose, glows = scene.target.mesh, scene.T_cam_body, emits(scene.target)
        location = view.location(pose.points(mesh.centre))
        self._objects[place].show(mesh, pose.rotation, location, split=split, glows=glows)
