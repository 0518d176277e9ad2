"""The calls of children that plan: one opens a stage, several share the planning of its pictures."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any

from msgspec import Meta, Struct

from spin_usd.processes.call import Call
from spin_usd.records.descriptions import PartEntry, StageOrigin, TargetEntry
from spin_usd.records.record import StageProvenance
from spin_usd.scene.body import Body
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.views import Views
from spin_usd.scene.effort import CPU
from spin_usd.scene.target import Part


class StageContent(Struct, frozen=True, kw_only=True):
    """The content that all pictures of a stage share."""

    targets: list[TargetEntry]
    parts: dict[str, PartEntry]
    """Parts of all bodies, by their ids in labels."""
    bodies: int
    camera: Annotated[list[int], Meta(min_length=2, max_length=2)]
    """Columns and rows of a picture."""
    lidar: bool
    event_camera: bool
    paired: bool
    """Whether another camera sees the same scene."""


class OpenPlan(Struct, frozen=True, kw_only=True):
    """The request to open a stage and describe it."""

    stage: str
    variants: tuple[str, ...] = ()
    """Names, and patterns with *, ? and [...]; empty means nominal alone, ("all",) all of them."""
    frames: str | None = None
    """Slice of the frames, such as 0:10; None for all."""
    seed: int | None = None
    """Seed of the dataset; None for the stage's own."""
    devices: tuple[str, ...] = (CPU,)
    """Devices that may render the light, the best first."""
    renders: bool = True
    """Whether light is rendered: labels alone need no texture, and a damaged one is not refused."""
    copy_to: str | None = None
    """Folder of our own to copy the stage to first, and to plan from."""
    trial: bool = False
    """Whether to measure how fast this machine is."""


class OpenedStage(Struct, frozen=True, kw_only=True):
    """A stage that is opened to be planned."""

    root: str
    """Its root layer's path, or its copy's."""
    seed: int
    variants: list[str]
    """Wanted variants, in their order."""
    device: str
    """First of the offered devices that can render all of its pictures."""
    known_variants: list[str]
    """All variants."""
    names: list[str]
    """Names of all frames."""
    chosen: list[int]
    """Places of the wanted frames."""
    origin: StageOrigin
    """Inputs and options that it was made from."""
    content: StageContent
    trial_s: float | None
    """Seconds of a trial of this machine, if one was requested."""


class PlanPart(Struct, frozen=True, kw_only=True):
    """The request to plan some of the frames of a stage, in all variants."""

    root: str
    """Root layer; it need not be opened again where this child opened it."""
    variants: list[str]
    chosen: list[int]
    """Places of the frames in the stage."""
    settings: RenderSettings
    image_suffix: str | None
    """Suffix of the image files; None without images."""
    labels: tuple[str, ...]
    """Wanted labels."""
    renders: bool = True
    """Whether light is rendered, as for OpenPlan."""
    provenance: tuple[str, ...] = ()
    """Variants to return the stage's provenance of."""
    explain: bool = False
    """Whether to count the work that the scenes do not need."""


class PlannedPart(Struct, frozen=True, kw_only=True):
    """The pictures of a variant that one child has planned."""

    variant: str
    stage: StageProvenance | None
    """Provenance, relative to the stage's own folder; None if not requested."""
    skipped: list[Any]
    """Work that the scenes do not need, from SkippedWorkCounter.taken."""
    notes: list[str]
    """Sentences on differences between the render and the stage."""
    views: Views | None
    columns: dict[str, list[Any] | None]
    """Columns by the names of COLUMNS, one entry a picture; None for the same column as in the variant before."""


OPEN_PLAN = Call("spin_usd.planning.in_child:StagePlanner", OpenPlan, OpenedStage)
PLAN_PART = Call("spin_usd.planning.in_child:StagePlanner.pictures", PlanPart, list[PlannedPart])


def described_target(body: Body) -> TargetEntry:
    """Return a target's entry in dataset.json."""
    target = body.target
    return TargetEntry(
        id=body.id,
        name=target.name,
        path=target.path,
        size=target.mesh.size.tolist(),
        box=target.mesh.box.tolist(),
        keypoints=dict(zip(target.keypoint_names, target.drawn_keypoints.tolist(), strict=True)),
    )


def described_parts(
    bodies: Iterable[tuple[int, int, Sequence[Part]]], shown: Iterable[Body]
) -> Iterator[tuple[str, PartEntry]]:
    """Yield the parts of all bodies by their ids in labels. `bodies`: for each its id, the number of parts before its
    own, and its parts; `shown`: all of them in one picture."""
    materials: dict[str, list[str]] = {}
    for body in shown:
        names = body.target.part_materials
        materials |= {part.path: list(names.get(part.id, ())) for part in body.target.parts}
    for target, before, parts in bodies:
        for part in parts:
            named = materials.get(part.path, [])
            entry = PartEntry(path=part.path, class_=part.class_name, name=part.name, target=target, materials=named)
            yield str(before + part.id), entry
