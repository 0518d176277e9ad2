"""One body of a stage: its pose in the camera's axes, and its shape, at each time."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from enum import Enum

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from spin_usd.errors import StageError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.body import BodyMotion
from spin_usd.scene.target import Target
from spin_usd.stage.read.bodies.find_bodies import OccluderPrims
from spin_usd.stage.read.bodies.gprim import MaterialUse
from spin_usd.stage.read.bodies.keypoints import find_keypoints
from spin_usd.stage.read.bodies.target import TargetReader
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.read.known_motion import KnownMotion
from spin_usd.stage.read.numbering import Numbering
from spin_usd.stage.read.planet import MAX_DISTANCE_M
from spin_usd.stage.read.shared_poses import Placed, SharedPoses
from spin_usd.stage.usd.time_variation import CachedIfConstant, has_varying_attribute, moves, varying, visibility_varies
from spin_usd.stage.usd.transforms import (
    UNIT_SCALE_TOLERANCE,
    between,
    check_chain,
    nearest_ancestor,
    placement,
    placement_below,
)
from spin_usd.stage.usd.visibility import ancestors, is_invisible

OpenReader = Callable[[Usd.Prim, Usd.TimeCode], TargetReader]
"""Opens the reader of the contents of a prim's axes, at a time."""


class BodyReader:
    """Reads one body: a target, or an occluder.

    The readers refer to prims, not to this object: a reference cycle would keep the stage open for a while.

    Attributes:
        id: The target's, 0 of an occluder.
        prim: The one whose axes are the body's.
        part_offset: As Body has it.
        moves_smoothly: Whether its rates are known.
    """

    def __init__(
        self,
        body: Usd.Prim | OccluderPrims,
        *,
        numbering: Numbering,
        camera: Usd.Prim,
        metres: float,
        clock: Clock,
        open_reader: OpenReader,
        shared: SharedPoses | None = None,
    ) -> None:
        """Find the body's axes and numbers.

        Args:
            numbering: The stage's.
            camera: The stage's.
            metres: The length of a stage unit.
            clock: The stage's.
            shared: The poses of the same body in another variant, which are kept for further ones too.
        """
        self._metres, self._open = metres, open_reader
        self._roots = body.roots if isinstance(body, OccluderPrims) else ()
        self.prim: Usd.Prim = body.frame if isinstance(body, OccluderPrims) else body
        self.id, self.part_offset = numbering.id_of(self.prim), numbering.part_offset(self.prim)
        check_chain(self.prim)
        self._motion = KnownMotion.of(self.prim, clock)
        self.moves_smoothly: bool = self._motion is not None
        self._seen_still = not (moves(camera) or any(moves(prim) for prim in ancestors(self.prim)[-1:]))
        self._chain = [each for each in (*ancestors(self.prim), self.prim) if _may_hide(each)]
        self._above = common_frame(camera, self.prim)
        self._usdcam_below = CachedIfConstant(moves(camera), _camera_below(self._above, camera))
        self.shared = None if shared is None else shared.of(camera, self.prim)
        self._last: Target | None = None
        self._scale: float | None = None  # that it was last read with
        self._varies = Variation.SHAPE
        self._uses: Sequence[MaterialUse] = ()

    def pose_at(self, time_code: float) -> Transform:
        """Compute T_cam_body at a time code."""
        time = Usd.TimeCode(time_code)
        return self.placed(time, UsdGeom.XformCache(time))[0]

    def placed(self, time: Usd.TimeCode, world: UsdGeom.XformCache) -> Placed:
        """Return T_cam_body, and the scale of the body's axes in the world."""
        if self.shared is None:
            return self._placed(time, world)
        return self.shared.at(time, lambda: self._placed(time, world))

    def _placed(self, time: Usd.TimeCode, world: UsdGeom.XformCache) -> Placed:
        """Compute the result of `placed`. Units are applied last: they would round a far origin."""
        usdcam, size = self._usdcam_below.at(time)
        body = placement_below(self._above, self.prim, world, frame="body")
        T_above_body = body.transform
        if self._motion and (correction := self._motion.correction(time.GetValue(), body.scale)):
            T_above_body = T_above_body @ correction
        near = between(usdcam, T_above_body)
        metres = near.translation * (size * self._metres)
        if not np.abs(metres).max() <= MAX_DISTANCE_M:
            found = f"is {np.abs(metres).max():g} m from the camera, more than {MAX_DISTANCE_M:g} m"
            raise StageError(found, where=self.prim.GetPath(), do="check the units and the translations")
        return T_CAM_USDCAM @ Transform.unchecked(
            to=near.to, of=near.of, rotation=near.rotation, translation=metres
        ), size * body.scale

    def motion_at(self, time_code: float, T_cam_body: Transform, scale: float) -> BodyMotion | None:
        """Return the body's motion relative to the camera at its pose then; None if unknown."""
        if self._motion is None or not self._seen_still:
            return None
        motion = self._motion.at(time_code)
        R_cam_parent = T_cam_body.rotation @ motion.rotation.T
        velocity = R_cam_parent @ motion.velocity * (scale * self._metres)
        return BodyMotion(velocity=velocity, angular_velocity=R_cam_parent @ motion.rate)

    def is_hidden(self, time: Usd.TimeCode) -> bool:
        """Return whether the body is invisible as a whole at a time."""
        return any(is_invisible(prim, time) for prim in self._chain)

    def changes_of_visibility(self) -> list[float]:
        """List the time codes, ascending, from which on the body may be hidden or shown."""
        attributes = (UsdGeom.Imageable(prim).GetVisibilityAttr() for prim in self._chain)
        return sorted({time for attribute in attributes for time in attribute.GetTimeSamples()})

    def forget_shape(self) -> None:
        """Forget the shape that was read last, which `target_at` reads again."""
        self._last = self._scale = None

    def target_at(self, time: Usd.TimeCode, scale: float) -> Target | None:
        """Read the shape, its axes scaled so: the last one again where nothing in it can vary, or nothing did; with the
        same mesh where materials alone did; None for an occluder that is not visible at all. Raises StageError for such
        a target."""
        same_size = self._scale is not None and abs(scale - self._scale) < UNIT_SCALE_TOLERANCE
        if same_size and self._varies is Variation.NONE and (self._roots or not self.is_hidden(time)):
            return self._last
        reader = self._open(self.prim, time)
        shaped = self._last if same_size and self._varies is Variation.LOOK else None
        found = reader.read_look(shaped, self._uses) if shaped else None
        if found is None:
            found = self._read(reader, scale * self._metres)
            self._uses = reader.uses
        if self._scale is None:
            self._varies = self._variation(reader)
        if self._last is None or found is None or found.key != self._last.key:
            self._last = found
        self._scale = scale
        return self._last

    def _read(self, reader: TargetReader, metres: float) -> Target | None:
        """Read the whole shape, with the last one's mesh if equal; `metres`: a unit of its axes."""
        found = reader.read_occluder(self._roots, metres) if self._roots else reader.read(metres)
        last = self._last
        if found and last and (found.mesh.key, found.mesh.shading_key) == (last.mesh.key, last.mesh.shading_key):
            return replace(found, mesh=last.mesh)  # renderers keep what they made of it
        return found

    def _variation(self, reader: TargetReader) -> "Variation":
        if self._roots:
            return occluder_variation(self.prim, self._roots, reader.visited)
        return target_variation(self.prim, reader.visited)


def _may_hide(prim: Usd.Prim) -> bool:
    return bool(prim.IsA(UsdGeom.Imageable)) and UsdGeom.Imageable(prim).GetVisibilityAttr().HasAuthoredValue()


def common_frame(camera: Usd.Prim, prim: Usd.Prim) -> Usd.Prim:
    """Find the prim in whose axes the poses of both are compared: for a body fixed to the camera the camera's own axes,
    so that its pose is the same in all pictures."""
    below = prim.GetPath().HasPrefix(camera.GetPath())
    if below and (prim == camera or not UsdGeom.XformCache().ComputeRelativeTransform(prim, camera)[1]):
        return camera
    return nearest_ancestor(camera, prim)


def _camera_below(above: Usd.Prim, camera: Usd.Prim) -> Callable[[Usd.TimeCode], tuple[Transform, float]]:
    """Return a function for T_above_usdcam in units of `above`, and for the size of these units in the world."""

    def compute(time: Usd.TimeCode) -> tuple[Transform, float]:
        world = UsdGeom.XformCache(time)
        matrix = world.GetLocalToWorldTransform(above)
        size = placement(matrix, frame="above", metres=1.0, where=above.GetPath()).scale
        return placement_below(above, camera, world, frame="usdcam").transform, size

    return compute


class Variation(Enum):
    """Changes of a body in time, apart from its own pose; LOOK: only inputs of materials."""

    NONE, LOOK, SHAPE = range(3)


def target_variation(target: Usd.Prim, read: list[Usd.Prim]) -> Variation:
    """Return the possible changes of the target where it is not hidden. read: the prims that it was read from."""
    if varying(target) - {UsdGeom.Tokens.visibility}:
        return Variation.SHAPE
    return _variation_of(
        prim for prim in (*read, *_keypoints_chain(target)) if prim != target and has_varying_attribute(prim)
    )


def occluder_variation(frame: Usd.Prim, roots: Sequence[Usd.Prim], read: list[Usd.Prim]) -> Variation:
    """Return the possible changes of an occluder with these `roots` in the axes of `frame`, which may be one of them.
    read: the prims that it was read from."""
    if any(visibility_varies(prim) for root in roots for prim in ancestors(root)):
        return Variation.SHAPE
    return _variation_of(prim for prim in read if (varying(prim) if prim == frame else has_varying_attribute(prim)))


def _variation_of(varying: Iterable[Usd.Prim]) -> Variation:
    """Return the changes from these varying prims."""
    looks = [prim.IsA(UsdShade.Shader) or prim.IsA(UsdShade.NodeGraph) for prim in varying]
    if not looks:
        return Variation.NONE
    return Variation.LOOK if all(looks) else Variation.SHAPE


def _keypoints_chain(target: Usd.Prim) -> list[Usd.Prim]:
    """List the prim of the keypoints and all from there up to the target: their poses move the keypoints."""
    keypoints = find_keypoints(target)
    chain = [*ancestors(keypoints), keypoints] if keypoints else []
    return [prim for prim in chain if prim.GetPath().HasPrefix(target.GetPath())]
