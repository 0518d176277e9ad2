"""All bodies of a stage: found in the order of their ids, placed at an exposure, and read without a picture."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cached_property, partial
from itertools import islice

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.scene.body import OCCLUDER, Body
from spin_usd.scene.target import Target
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.target import TargetReader
from spin_usd.stage.read.body_reader import BodyReader
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.read.numbering import Numbering
from spin_usd.stage.read.shared_poses import SharedPoses
from spin_usd.stage.read.shutter import Opening, PoseAt, read_poses
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.visibility import first_shown

STILL_PX = 0.05  # from the first to the last light: no picture shows it
MAX_KEPT_FACES = 1 << 22  # of targets, hidden ones too; 70 bytes each


class BodyReaders:
    """Reads the targets, in order of their ids, and then the occluders of a stage."""

    def __init__(
        self,
        stage: Usd.Stage,
        camera: Usd.Prim,
        *,
        metres: float,
        clock: Clock,
        numbering: Numbering,
        group_of: Callable[[Usd.Prim], int],
        images: Images,
        notes: Notes,
        before: Iterable[BodyReader],
        keep_poses: bool,
    ) -> None:
        """`metres`: the length of a stage unit. `clock`: the stage's. `group_of`: the light links' group of a prim.
        `before`: readers of an earlier variant, whose poses may be the same; with `keep_poses` they are kept for later
        variants. Raises like Numbering.in_order."""
        self._camera, self._metres, self._numbering = camera, metres, numbering
        self._group_of, self._images = group_of, images
        self._readers: tuple[BodyReader, ...]

        def open_reader(prim: Usd.Prim, time: Usd.TimeCode) -> TargetReader:
            parts = numbering.parts_of(prim)
            return TargetReader(prim=prim, parts=parts, time=time, group_of=group_of, images=images, notes=notes)

        make = partial(
            BodyReader, camera=camera, metres=metres, clock=clock, open_reader=open_reader, numbering=numbering
        )
        self._kept: dict[BodyReader, int] = {}  # faces of targets that were read, the last one last
        found = numbering.in_order(stage)
        if not keep_poses:
            self._readers = tuple(make(body) for body in found)
            return
        known = [body.shared or SharedPoses() for body in islice(before, len(found))]
        known += [SharedPoses() for _ in found[len(known) :]]
        self._readers = tuple(make(body, shared=poses) for body, poses in zip(found, known, strict=True))

    def __iter__(self) -> Iterator[BodyReader]:
        return iter(self._readers)

    def __len__(self) -> int:
        return len(self._readers)

    def __getitem__(self, place: int) -> BodyReader:
        return self._readers[place]

    def at(self, opening: Opening, world: UsdGeom.XformCache, *, focal: float) -> tuple[Body, ...]:
        """Read the bodies that are visible in the middle of an exposure by a camera of the `focal` length, pixels.
        Where nothing is authored of the shutter, those move whose rates are known, and it is an instant where none of
        them moves by STILL_PX."""
        time = Usd.TimeCode(opening.middle)
        placed = [(reader, *reader.placed(time, world)) for reader in self._shown(time)]
        shapes = [(reader, pose, self._target(reader, time, scale)) for reader, pose, scale in placed]
        bodies = [
            Body(
                id=reader.id,
                target=target,
                T_cam_body=pose,
                part_offset=reader.part_offset,
                motion=reader.motion_at(opening.middle, pose, scale),
            )
            for (reader, pose, target), (_, _, scale) in zip(shapes, placed, strict=True)
            if target
        ]
        shown = [reader for reader, _, target in shapes if target]
        if opening.of_exposure and not any(map(partial(_moves, opening, focal), shown, bodies)):
            return tuple(bodies)
        poses = read_poses(opening, list(map(partial(_pose_at, opening), shown, bodies)), self._camera.GetPath())
        return tuple(replace(body, poses=own) if own else body for body, own in zip(bodies, poses, strict=True))

    def _target(self, reader: BodyReader, time: Usd.TimeCode, scale: float) -> Target | None:
        """Read the shape of a body as BodyReader.target_at does; where targets have too many faces together, forget the
        hidden ones that were read longest ago."""
        found = reader.target_at(time, scale)
        if reader.id != OCCLUDER and found:
            self._kept.pop(reader, None)
            self._kept[reader] = found.mesh.count
            while sum(self._kept.values()) > MAX_KEPT_FACES:
                oldest = next((each for each in self._kept if each.is_hidden(time)), None)
                if oldest is None:
                    break
                oldest.forget_shape()
                del self._kept[oldest]
        return found

    def _shown(self, time: Usd.TimeCode) -> tuple[BodyReader, ...]:
        """Return the bodies without the hidden targets; where all targets are hidden, with the first."""
        changes, shown = self._shown_targets
        targets = shown[bisect_right(changes, time.GetValue())]
        return (*(targets or self._readers[:1]), *(each for each in self._readers if each.id == OCCLUDER))

    @cached_property
    def _shown_targets(self) -> tuple[list[float], list[list[BodyReader]]]:
        """The N time codes, ascending, from which on other targets are shown, and the N + 1 lists of those shown before
        each and after the last: of a thousand targets, too many to look at for each picture."""
        targets = [reader for reader in self._readers if reader.id != OCCLUDER]
        own = {reader: reader.changes_of_visibility() for reader in targets}
        changes = sorted({time for times in own.values() for time in times})
        shown: list[list[BodyReader]] = [[] for _ in range(len(changes) + 1)]
        for reader, times in own.items():
            for start, end in zip((None, *times), (*times, None), strict=True):
                if not reader.is_hidden(Usd.TimeCode.EarliestTime() if start is None else Usd.TimeCode(start)):
                    first = 0 if start is None else bisect_right(changes, start)
                    last = len(changes) if end is None else bisect_left(changes, end)
                    for place in range(first, last + 1):
                        shown[place].append(reader)
        return changes, shown

    def hidden_targets_at(self, time_code: float) -> Iterator[Body]:
        """Read the targets that are hidden at a time code, each as it is when it first is visible. Raises StageError
        for one that never is."""
        for reader in self._readers:
            if reader.id != OCCLUDER and reader.is_hidden(Usd.TimeCode(time_code)):
                time = first_shown(reader.prim, Usd.TimeCode(time_code))
                pose, scale = reader.placed(time, UsdGeom.XformCache(time))
                target = self._target(reader, time, scale)
                assert target  # else it was refused
                yield Body(id=reader.id, target=target, T_cam_body=pose, part_offset=reader.part_offset)

    def target_at(self, time_code: float) -> Target:
        """Read the first target alone at a time code, metres."""
        time = Usd.TimeCode(time_code)
        first = self._shown(time)[0]
        target = self._target(first, time, first.placed(time, UsdGeom.XformCache(time))[1])
        assert target  # else it was refused
        return target

    def whole_target_at(self, time_code: float) -> Target:
        """Read the first target alone at a time code, metres, with the surfaces that cannot be seen."""
        time, prim = Usd.TimeCode(time_code), self._readers[0].prim
        scale = self._readers[0].placed(time, UsdGeom.XformCache(time))[1]
        reader = TargetReader(
            prim=prim,
            parts=self._numbering.parts_of(prim),
            time=time,
            group_of=self._group_of,
            images=self._images,
            notes=Notes(),
            whole=True,
        )
        return reader.read(scale * self._metres)

    def targets_at(self, time_code: float) -> dict[int, Target]:
        """Read all targets at a time code, metres, by their ids."""
        time = Usd.TimeCode(time_code)
        world = UsdGeom.XformCache(time)
        targets = (body for body in self._shown(time) if body.id != OCCLUDER)
        found = {body.id: self._target(body, time, body.placed(time, world)[1]) for body in targets}
        return {number: target for number, target in found.items() if target}


def _moves(opening: Opening, focal: float, reader: BodyReader, body: Body) -> bool:
    """Return whether a point of the body may move by more than STILL_PX in the exposure."""
    motion, mesh = body.motion, body.target.mesh
    if motion is None:
        return reader.moves_smoothly
    reach = float(np.linalg.norm(mesh.centre)) + mesh.radius
    speed = np.linalg.norm(motion.velocity) + reach * np.linalg.norm(motion.angular_velocity)
    way = float(speed) * opening.duration
    depth, margin = float(body.T_cam_body.points(mesh.centre)[2]), mesh.radius + way
    return depth > -margin and (depth <= margin or way * focal > STILL_PX * (depth - margin))


def _pose_at(opening: Opening, reader: BodyReader, body: Body) -> PoseAt:
    """Return a function for the body's pose: the body rests while only exposure:time opens the shutter, unless its
    rates are known."""
    return (lambda _: body.T_cam_body) if opening.of_exposure and not reader.moves_smoothly else reader.pose_at
