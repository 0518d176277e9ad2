"""What the child that opens a stage to plan it answers, before it plans any picture."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated

from msgspec import Meta, Struct

from spin_usd.records.descriptions import PartEntry, StageOrigin, TargetEntry
from spin_usd.scene.body import Body
from spin_usd.scene.target import Part


class StageContent(Struct, frozen=True, kw_only=True):
    """What all pictures of a stage share."""

    targets: list[TargetEntry]
    parts: dict[str, PartEntry]
    """Of all bodies, by their ids in labels."""
    bodies: int
    camera: Annotated[list[int], Meta(min_length=2, max_length=2)]
    """Columns and rows of a picture."""
    lidar: bool
    event_camera: bool
    paired: bool
    """Whether a further camera sees what this one does."""


class OpenedStage(Struct, frozen=True, kw_only=True):
    """A stage that is opened to be planned."""

    root: str
    """Its root layer's path, or its copy's."""
    seed: int
    variants: list[str]
    """Those wanted, in their order."""
    device: str
    """The first of the devices offered that can render all of its pictures."""
    known_variants: list[str]
    """All that it has."""
    names: list[str]
    """Of all of its frames."""
    chosen: list[int]
    """Places of those wanted."""
    origin: StageOrigin
    """What it was made from."""
    content: StageContent
    trial_s: float | None
    """Seconds of a trial of this machine, where that was asked."""


def described_target(body: Body) -> TargetEntry:
    """Return what dataset.json says of a target."""
    target = body.target
    return TargetEntry(
        id=body.id,
        name=target.name,
        path=target.path,
        size=target.mesh.size.tolist(),
        box=target.mesh.box.tolist(),
        keypoints={name: point.tolist() for name, point in zip(target.keypoint_names, target.keypoints, strict=True)},
    )


def described_parts(
    bodies: Iterable[tuple[int, int, Sequence[Part]]], shown: Iterable[Body]
) -> Iterator[tuple[str, PartEntry]]:
    """Yield the parts of all bodies by their ids in labels. `bodies`: of each its id, the number of parts before its
    own, and its parts; `shown`: all of them as a picture shows them."""
    materials: dict[str, list[str]] = {}
    for body in shown:
        names = body.target.part_materials
        materials |= {part.path: list(names.get(part.id, ())) for part in body.target.parts}
    for target, before, parts in bodies:
        for part in parts:
            named = materials.get(part.path, [])
            entry = PartEntry(path=part.path, class_=part.class_name, name=part.name, target=target, materials=named)
            yield str(before + part.id), entry
