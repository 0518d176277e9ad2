"""All bodies of a stage: found in the order of their ids, placed at an exposure, and read without a picture."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import islice

from pxr import Usd, UsdGeom

from spin_usd.scene.body import OCCLUDER, Body
from spin_usd.scene.target import Target
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.target import TargetReader
from spin_usd.stage.read.body_reader import BodyReader
from spin_usd.stage.read.numbering import Numbering
from spin_usd.stage.read.shared_poses import SharedPoses
from spin_usd.stage.read.shutter import Opening, read_poses
from spin_usd.stage.usd.root_metadata import Notes


class BodyReaders:
    """Reads the targets, in order of their ids, and then the occluders of a stage."""

    def __init__(
        self,
        stage: Usd.Stage,
        camera: Usd.Prim,
        *,
        metres: float,
        numbering: Numbering,
        group_of: Callable[[Usd.Prim], int],
        images: Images,
        notes: Notes,
        before: Iterable[BodyReader],
        keep_poses: bool,
    ) -> None:
        """`metres`: the length of a stage unit. `group_of`: the light links' group of a prim. `before`: those of a
        variant before, whose poses may be the same; with `keep_poses` they are kept for variants after this one. Raises
        as Numbering.in_order."""
        self._camera, self._metres, self._numbering = camera, metres, numbering
        self._group_of, self._images = group_of, images
        self._readers: tuple[BodyReader, ...]

        def open_reader(prim: Usd.Prim, time: Usd.TimeCode) -> TargetReader:
            parts = numbering.parts_of(prim)
            return TargetReader(prim=prim, parts=parts, time=time, group_of=group_of, images=images, notes=notes)

        make = partial(BodyReader, camera=camera, metres=metres, open_reader=open_reader, numbering=numbering)
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

    def at(self, opening: Opening, world: UsdGeom.XformCache) -> tuple[Body, ...]:
        """Read the bodies that are visible in the middle of an exposure."""
        time = Usd.TimeCode(opening.middle)
        placed = [(reader, *reader.placed(time, world)) for reader in self._readers]
        shapes = [(reader, pose, reader.target_at(time, scale)) for reader, pose, scale in placed]
        shown = [(reader, pose, target) for reader, pose, target in shapes if target]
        poses = read_poses(opening, [reader.pose_at for reader, _, _ in shown], self._camera.GetPath())
        return tuple(
            Body(id=reader.id, target=target, T_cam_body=pose, poses=own, part_offset=reader.part_offset)
            for (reader, pose, target), own in zip(shown, poses, strict=True)
        )

    def target_at(self, time_code: float) -> Target:
        """Read the first target alone at a time code, metres."""
        time = Usd.TimeCode(time_code)
        first = self._readers[0]
        target = first.target_at(time, first.placed(time, UsdGeom.XformCache(time))[1])
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
        targets = (body for body in self._readers if body.id != OCCLUDER)
        found = {body.id: body.target_at(time, body.placed(time, world)[1]) for body in targets}
        return {number: target for number, target in found.items() if target}
