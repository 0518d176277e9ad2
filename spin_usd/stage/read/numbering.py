"""The numbers of all targets and parts of a stage: the same in every picture, even if prims are hidden, added or
reordered.

They count everything that any variant can show at any time, body by body: targets in the order of their ids, then
occluders; the parts of a body in order of their prim paths.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property

from pxr import Usd

from spin_usd.errors import SpinError, StageError
from spin_usd.scene.body import OCCLUDER
from spin_usd.scene.target import MAX_PARTS, Part
from spin_usd.stage.composition.open_stage import compositions
from spin_usd.stage.read.bodies.body_parts import BodyParts
from spin_usd.stage.read.bodies.find_bodies import OccluderPrims, find_occluders, find_targets, prim_of, target_name
from spin_usd.stage.read.camera import find_cameras


@dataclass(eq=False)
class Numbering:
    """The numbers of a stage's bodies and parts."""

    targets: tuple[str, ...] = ()
    """The paths of the stage's targets, whose ids count from 1."""
    _bodies: dict[str, BodyParts] = field(default_factory=dict)
    _names: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, stage: Usd.Stage, variant: str) -> "Numbering":
        """Number the bodies of `stage`, which is composed in `variant`. A further variant that cannot be read is
        ignored: it is refused when it is rendered. Raises the errors of reading `variant`."""
        numbering = cls()
        for name, composed in compositions(stage):
            if name == variant:
                numbering._add(stage)
            else:
                with suppress(SpinError):
                    numbering._add(composed())
        return numbering

    def in_order(self, stage: Usd.Stage) -> list[Usd.Prim | OccluderPrims]:
        """Find the bodies of the stage as composed, in the order of their numbers. Raises StageError unless targets and
        parts, with names and classes, are the same as in its other variants: ids would differ in meaning."""
        targets = find_targets(stage)
        for path in sorted({*self.targets} ^ {str(prim.GetPath()) for prim in targets}):
            found = "is not a target of this variant" if path in self.targets else "is a target of this variant alone"
            do = "give all variants the same targets: their ids hold in all of them"
            raise StageError(found, where=path, do=do)
        bodies = [*targets, *find_occluders(targets, find_cameras(stage).values())]
        names = [target_name(prim) for prim in targets]
        for prim, name in zip(targets, names, strict=True):
            if names.count(name) > 1:
                do = "give each its own spin:target:name: records and exports distinguish targets by it"
                raise StageError(f"has the name {name!r}, as another target has", where=prim.GetPath(), do=do)
        for prim in targets:
            here, there = target_name(prim), self._names[str(prim.GetPath())]
            if here != there:
                found = f"has the name {here!r} in this variant, and {there!r} in another"
                do = "give the target one name in all variants: records and exports are by it"
                raise StageError(found, where=prim.GetPath(), do=do)
        for body in bodies:
            prim = prim_of(body)
            if str(prim.GetPath()) not in self._bodies:
                raise StageError("is geometry that no variant has", where=prim.GetPath(), do="read the stage again")
            self._bodies[str(prim.GetPath())].refuse_others(body)
        return sorted(bodies, key=lambda body: self.part_offset(prim_of(body)))

    def id_of(self, body: Usd.Prim) -> int:
        """Return the id of the body in the axes of that prim: a target's, or OCCLUDER."""
        return self._id_of(str(body.GetPath()))

    @property
    def bodies(self) -> Iterator[tuple[int, int, tuple[Part, ...]]]:
        """Yield of each body in order its id, the number of parts before its own, and its parts."""
        for path, before in self._before.items():
            yield self._id_of(path), before, self._bodies[path].parts

    @cached_property
    def classes(self) -> tuple[str, ...]:
        """The class names of all parts, by their ids in labels from 1."""
        return tuple(part.class_name for _, _, parts in self.bodies for part in parts)

    def parts_of(self, body: Usd.Prim) -> BodyParts:
        """Return the parts of the body in the axes of that prim."""
        return self._bodies[str(body.GetPath())]

    def part_offset(self, body: Usd.Prim) -> int:
        """Count the parts of the bodies before the one in the axes of that prim: the offset from its parts' numbers to
        their ids in labels."""
        return self._before[str(body.GetPath())]

    @cached_property
    def _before(self) -> dict[str, int]:
        counts: dict[str, int] = {}
        total = 0
        for path in (*self.targets, *(path for path in self._bodies if path not in self.targets)):
            counts[path] = total
            total += len(self._bodies[path].numbers)
        if total > MAX_PARTS:
            do = "let parts share a name by spin:target:mergedParts, or make occluders one part each"
            raise StageError(f"its bodies have more than {MAX_PARTS} parts", do=do)
        return counts

    def _id_of(self, path: str) -> int:
        return self.targets.index(path) + 1 if path in self.targets else OCCLUDER

    def _add(self, stage: Usd.Stage) -> None:
        targets = find_targets(stage)
        occluders = find_occluders(targets, find_cameras(stage).values())
        self.targets = self.targets or tuple(str(prim.GetPath()) for prim in targets)
        for prim in targets:
            self._names.setdefault(str(prim.GetPath()), target_name(prim))
        for body in (*targets, *occluders):
            self._bodies.setdefault(str(prim_of(body).GetPath()), BodyParts()).add(body)
