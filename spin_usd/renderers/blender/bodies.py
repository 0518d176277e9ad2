"""The bodies of a scene in Blender: each in objects of its own, which move while the shutter is open."""

from collections.abc import Mapping, Sequence
from typing import Any

from spin_usd.renderers.blender.mesh import TargetObject
from spin_usd.renderers.blender.motion import MotionSetup
from spin_usd.renderers.camera_shader import View
from spin_usd.scene.material import Material
from spin_usd.scene.model import Scene


class BodySetup:
    """The bodies of one Blender scene, in the order of Scene.bodies. A body keeps its objects from picture to picture,
    so that only what changed is prepared anew."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._objects: list[TargetObject] = []
        self._motions: list[MotionSetup] = []
        self.count = 0
        """How many bodies there are."""

    def show_alone(self, place: int, scene: Scene, view: View, primvars: frozenset[str], *, split: bool) -> None:
        """Show cameras the body at `place` and no other; `scene` is the one with it alone."""
        self._make(place + 1)
        for motion in self._motions:
            motion.hold()
        self._place(place, scene, view, primvars, split=split)
        for number, objects in enumerate(self._objects):
            objects.show_camera(number == place)

    def show(self, scene: Scene, view: View, primvars: Sequence[frozenset[str]], *, split: bool) -> None:
        """Show all bodies of `scene`, as its shutter sees them; each has at least these of its mesh's `primvars`."""
        self.count = len(scene.apart)
        self._make(self.count)
        for place, (one, names) in enumerate(zip(scene.apart, primvars, strict=True)):
            self._place(place, one, view, names, split=split)
            self._motions[place].move(self._objects[place].axes, self._objects[place].objects, one)
            self._objects[place].show_camera(True)
        for number, objects in enumerate(self._objects):
            objects.hide(number >= self.count)

    def dress(self, scene: Scene, needed: Sequence[Sequence[Material]], *, emissive_lights: bool) -> None:
        """Give each body of `scene` the materials that are `needed`, as TargetObject.dress has it."""
        for body, objects, materials in zip(scene.bodies, self._objects, needed, strict=False):
            objects.dress(body.target.materials, materials, emissive_lights=emissive_lights)

    def number(self, place: int, materials: Sequence[Material]) -> None:
        """Let the faces of the body at `place` emit their numbers, where its materials do not cut them out."""
        self._objects[place].number(materials)

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

    def _place(self, place: int, scene: Scene, view: View, primvars: frozenset[str], *, split: bool) -> None:
        mesh, pose = scene.target.mesh, scene.T_cam_body
        location = view.location(pose.points(mesh.centre))
        self._objects[place].show(mesh, pose.rotation, location, split=split, primvars=primvars)
