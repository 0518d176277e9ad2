"""The parts that a body can show, hidden or not, numbered in order of their prim paths."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.scene.target import Part
from spin_usd.stage.read.bodies.face_subsets import named_subsets
from spin_usd.stage.read.bodies.find_bodies import OccluderPrims, prim_of
from spin_usd.stage.read.bodies.part_labels import Labels, labels_of_target
from spin_usd.stage.read.bodies.point_instancer import find_prototypes
from spin_usd.stage.read.bodies.renderable import geometry_below, is_geometry, is_left_out
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import RENDERED_PURPOSES, is_always_invisible, own_purpose, purpose_of

State = tuple[Labels, str]
"""State that a prim inherits: its part and class, and its purpose."""


@dataclass(eq=False)
class BodyParts:
    """The parts of one body. They are numbered once all are added."""

    _labels: dict[tuple[str, str], Labels] = field(default_factory=dict)

    def add(self, body: Usd.Prim | OccluderPrims) -> "BodyParts":
        """Add the parts that a target or an occluder can show as it is composed, at any time."""
        for labels in _parts_of(body):
            self._labels.setdefault(labels.part_key, labels)
        return self

    def refuse_others(self, body: Usd.Prim | OccluderPrims) -> None:
        """Raise StageError if the body as composed has a part that was not added, or was added with another name or
        class: a part's id implies both, in all variants."""
        first: dict[tuple[str, str], Labels] = {}
        for labels in _parts_of(body):
            first.setdefault(labels.part_key, labels)
        for labels in first.values():
            known = self._labels.get(labels.part_key)
            if known is None:
                raise StageError("is geometry that no variant has", where=labels.part_path, do="read the stage again")
            for what, here, there in (
                ("class", labels.part_class, known.part_class),
                ("name", labels.part_name, known.part_name),
            ):
                if here != there:
                    found = f"has the {what} {here!r} in this variant, and {there!r} in another"
                    do = f"give the part one {what} in all variants: its id represents it in all labels"
                    raise StageError(found, where=labels.part_path, do=do)

    @cached_property
    def numbers(self) -> dict[tuple[str, str], int]:
        """The numbers of the parts, from 1, by Labels.part_key."""
        by_path = sorted(self._labels, key=lambda key: self._labels[key].part_path)
        return {key: number for number, key in enumerate(by_path, 1)}

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """The parts in order of their numbers."""
        return tuple(_part(number, self._labels[key]) for key, number in self.numbers.items())


def _parts_of(body: Usd.Prim | OccluderPrims) -> Iterator[Labels]:
    """Yield the part of each piece of geometry that a body can show as it is composed, at any time."""
    frame, purpose = prim_of(body), purpose_of(prim_of(body))
    if isinstance(body, OccluderPrims):
        roots, start = body.roots, Labels().below(frame)
    else:
        roots, start = (body,), labels_of_target(body)
    for root in roots:
        yield from _parts_below(root, (start, purpose) if root == frame else _entered(root, (Labels(), purpose)))


def _parts_below(prim: Usd.Prim, state: State) -> Iterator[Labels]:
    """Yield the part of each piece of geometry at and below `prim`, which has `state`, that can be rendered."""

    def shown(child: Usd.Prim) -> bool:
        return not is_always_invisible(child)

    for current, (labels, purpose) in geometry_below(prim, state, enter=_entered, shown=shown):
        if purpose not in RENDERED_PURPOSES or is_left_out(current, Notes()) or not is_geometry(current):
            continue
        if current.IsA(UsdGeom.PointInstancer):
            for prototype in filter(shown, find_prototypes(current)):
                yield from _parts_below(prototype, _entered(prototype, (labels, purpose)))
        else:
            yield from _parts_of_gprim(current, labels.of_gprim(current))


def _parts_of_gprim(prim: Usd.Prim, labels: Labels) -> Iterator[Labels]:
    """Yield the parts of a gprim that can have faces: its subsets' parts, and its own if they leave faces."""
    counts = UsdGeom.Mesh(prim).GetFaceVertexCountsAttr() if prim.IsA(UsdGeom.Mesh) else None
    faces = 1 if counts is None else len(read(counts, Usd.TimeCode.EarliestTime()) or ())
    still = counts is None or not counts.ValueMightBeTimeVarying()
    if still and not faces:
        return
    named: set[int] = set()
    for subset, own in named_subsets(prim, labels):
        if read(subset.GetElementTypeAttr()) != UsdGeom.Tokens.face:
            continue
        indices = read(subset.GetIndicesAttr(), Usd.TimeCode.EarliestTime()) or ()
        still = still and not subset.GetIndicesAttr().ValueMightBeTimeVarying()
        if len(indices) or not still:
            yield own
        named.update(indices)
    if not still or len(named) < faces:
        yield labels


def _entered(prim: Usd.Prim, state: State) -> State:
    labels, purpose = state
    return labels.below(prim), own_purpose(prim, purpose)


def _part(number: int, labels: Labels) -> Part:
    return Part(id=number, path=labels.part_path, name=labels.part_name, class_name=labels.part_class)
