"""Rules on pictures: every picture of every variant is read as for a render."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.basics.progress import Progress
from spin_usd.errors import SpinError
from spin_usd.geometry.blur import rotation_angle
from spin_usd.scene.derived.view_text import MESSAGES, number_text, sentence, size_text
from spin_usd.scene.derived.views import ViewCollector, ViewKind, Views
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.scene.plausible import SIZES, is_plausible
from spin_usd.scene.scene import Scene, augmentation_and_camera
from spin_usd.scene.target import Target
from spin_usd.stage.check.identical_variants import IdenticalVariants
from spin_usd.stage.check.refusals import refusals
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.open_stage import open_stage, variants
from spin_usd.stage.read.body_reader import BodyReader
from spin_usd.stage.read.camera import picture_variants
from spin_usd.stage.read.numbering import Numbering
from spin_usd.stage.read.shutter import Opening, read_opening
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd.parser_faults import parser_faults
from spin_usd.stage.usd.visibility import ancestors

MAX_VARIANTS = 200  # of one set; each is composed and read
READING = "reading: picture"
PROGRESS_EVERY = 100

TargetRule = Callable[[Target], Iterator[Finding]]
"""A rule on a body's shape."""
OnViews = Callable[[Views], None]
"""Called with the views of a stage's own pictures, of its first variant."""

MAX_TURN_RAD = np.radians(30.0)  # from one time sample to the next

CODES = {
    ViewKind.CAMERA_INSIDE: "camera-inside",
    ViewKind.BEHIND: "target-behind",
    ViewKind.OUTSIDE: "target-outside",
    ViewKind.CUT_OFF: "target-cut-off",
    ViewKind.FEW_PIXELS: "target-small",
    ViewKind.UNLIT: "target-unlit",
    ViewKind.DARK: "target-dark",
}


def scene_findings(
    path: str | Path, stage: Usd.Stage, *, progress: Progress, target_rule: TargetRule, on_views: OnViews
) -> Iterator[Finding]:
    """Yield the errors that a render of the stage at `path` would raise: for each variant the first picture that cannot
    be read, with all its faults, as the readers report them. Faults shared by variants are reported once, for the
    first; findings of `target_rule` once for each shape of a body. `on_views` receives the views of the pictures.

    `stage`: the same stage as opened for checks. One that does not compose is not read: USD's validators report that.
    """
    if composition_errors(stage):
        return
    names = _variants(stage)
    if len(names) > MAX_VARIANTS:
        message = f"has {len(names)} variants, of which the first {MAX_VARIANTS} were looked at"
        yield Finding(code="variant-many", where=str(path), message=message, severity=WARNING)
    reported: set[tuple[str, str]] = set()
    identical, shapes = IdenticalVariants(path), Shapes(target_rule)
    numbering: Numbering | None = None
    for index, name in enumerate(names[:MAX_VARIANTS]):
        check = _VariantCheck(path, name, reported, identical, shapes, numbering)
        yield from check.findings(index, min(len(names), MAX_VARIANTS), progress)
        numbering = check.numbering
        if index == 0 and check.views:
            on_views(check.views)


def _variants(stage: Usd.Stage) -> tuple[str, ...]:
    """List the variants of the stage's pictures. If its cameras cannot be distinguished, list its augmentations, each
    of which then reports why."""
    with suppress(SpinError):
        return picture_variants(stage)
    return variants(stage)


class Shapes:
    """Applies a rule to each shape of the bodies once."""

    def __init__(self, rule: TargetRule) -> None:
        self._rule = rule
        self._seen: set[str] = set()

    def findings(self, target: Target) -> Iterator[Finding]:
        """Yield the rule's findings, unless the shape was checked before."""
        if target.mesh.key not in self._seen:
            self._seen.add(target.mesh.key)
            yield from self._rule(target)


class _VariantCheck:
    """One variant's pictures. `reported`: the prims and messages reported already. `identical` and `shapes` have
    seen the variants before; `numbering` is the stage's, once a variant could be read."""

    def __init__(
        self,
        path: str | Path,
        variant: str,
        reported: set[tuple[str, str]],
        identical: IdenticalVariants,
        shapes: Shapes,
        numbering: Numbering | None,
    ) -> None:
        self.path, self.variant, self.reported, self.identical, self.shapes = path, variant, reported, identical, shapes
        self.numbering, self.picture = numbering, ""
        self.views: Views | None = None

    def findings(self, index: int, count: int, progress: Progress) -> Iterator[Finding]:
        """Read all pictures and yield findings. `index`: of the variant among `count`, for the progress."""
        try:
            with parser_faults(self.path):
                reader = StageReader(self.path, variant=self.variant, numbering=self.numbering)
                self.numbering = reader.numbering
                blended = BlendedPoses(reader)
                seen = {str(body.prim.GetPath()): ViewCollector(target=body.id) for body in reader.bodies if body.id}
                of_any = ViewCollector()
                collectors = (*seen.values(), *((of_any,) if len(seen) > 1 else ()))
                for done, frame in enumerate(reader.frames):
                    if done % PROGRESS_EVERY == 0:
                        progress(READING, index * len(reader.frames) + done, count * len(reader.frames))
                    self.picture = frame.name
                    scene = reader.scene(frame)
                    blended.add(scene)
                    for collector in collectors:
                        collector.add(scene)
                    for body in scene.bodies:
                        yield from self.shapes.findings(body.target)
                    self.identical.add(scene, len(reader.frames))
                progress(READING, (index + 1) * len(reader.frames), count * len(reader.frames))
        except SpinError as error:
            for each in (error, *self._others()):
                do = f"; {each.do}" if each.do else ""
                yield from self._once("scene", each.where or self.path, each.found, do)
            return
        for note in reader.notes:
            yield from self._once(note.code, note.where, note.message, "", note.severity)
        yield from self.identical.findings(self.variant)
        if blended.pictures:
            self.picture = blended.pictures[0]
            yield from self._once("pose-blended", blended.where, blended.found, f"; {blended.do}", WARNING)
        self.picture = ""
        views = [(path, collector.views()) for path, collector in seen.items()]
        for finding in self._findings_on_views(views, of_any.views()):
            yield from self._once(finding.code, finding.where, finding.message, "", finding.severity)

    def _findings_on_views(self, seen: Sequence[tuple[str, Views | None]], of_any: Views | None) -> Iterator[Finding]:
        """Yield findings on the views of each target, given with its path: all for the first; for others only that no
        picture shows them, since some merely pass by. Targets that are shown in turn, one in each picture, are one to
        them: `of_any` has the views of whichever each picture shows."""
        shown = [views.pictures for _, views in seen if views]
        if of_any and len(shown) > 1 and sum(shown) == of_any.pictures:
            seen = [(str(self.path), of_any)]
        (first, self.views), *others = seen
        yield from view_findings(self.views, first) if self.views else ()
        for path, views in others:
            found = view_findings(views, path) if views else ()
            yield from (finding for finding in found if finding.severity == ERROR)

    def _others(self) -> Iterator[SpinError]:
        """Yield all other errors of the variant's readers; reading a picture ended at the first of them."""
        with suppress(SpinError), parser_faults(self.path):  # a variant that cannot be opened was reported already
            yield from refusals(open_stage(self.path, variant=augmentation_and_camera(self.variant)[0]))

    def _once(self, code: str, where: object, found: str, do: str, severity: str = "error") -> Iterator[Finding]:
        if (str(where), found) not in self.reported:
            self.reported.add((str(where), found))
            at = f"picture {self.picture} of variant" if self.picture else "variant"
            message = f"{found}{do} ({at} {self.variant})"
            yield Finding(code=code, where=str(where), message=message, severity=severity)


class BlendedPoses:
    """Collects the pictures whose exposure blends time samples that differ by more than one motion would.

    That is a rotation above MAX_TURN_RAD, or a path longer than the first target's size (twice the radius about its
    centre). USD interpolates between time samples. In a list of unrelated poses, whose time codes only count them, the
    poses between two of them are not a real motion.
    """

    do = "bring shutter:open and shutter:close together, or give the poses the times of one motion"

    def __init__(self, reader: StageReader) -> None:
        self.pictures: list[str] = []
        self._camera, self._bodies, self._clock = reader.camera_prim, reader.bodies, reader.clock
        self.where = str(reader.bodies[0].prim.GetPath())
        self._times = [self._moving_times(body.prim) for body in reader.bodies]

    @property
    def found(self) -> str:
        """The finding's message."""
        return (
            f"the exposures of {len(self.pictures)} pictures blend time samples between which a body rotates by "
            f"more than {np.degrees(MAX_TURN_RAD):g} degrees or moves by more than its size"
        )

    def add(self, scene: Scene) -> None:
        """Look at one picture of the reader's stage."""
        if scene.shutter is None:
            return
        opening = read_opening(self._camera, scene.frame.time_code, self._clock, rows=scene.camera.height)
        size = 2 * scene.bodies[0].target.mesh.radius
        if any(self._blends(body, times, opening, size) for body, times in zip(self._bodies, self._times, strict=True)):
            self.pictures.append(scene.frame.name)

    def _moving_times(self, prim: Usd.Prim) -> list[float]:
        """List the times of all samples that move the prim or the camera."""
        moving = [each for end in (self._camera, prim) for each in (*ancestors(end), end)]
        ops = [op for each in moving for op in UsdGeom.Xformable(each).GetOrderedXformOps()]
        return sorted({float(time) for op in ops for time in op.GetTimeSamples()})

    def _blends(self, body: BodyReader, times: list[float], opening: Opening, size: float) -> bool:
        """Return whether the exposure blends poses of `body`, sampled at `times`, that no motion joins."""
        if opening.of_exposure or body.moves_smoothly:
            return False
        start, _, end = opening.time_codes(3)
        first, last = bisect_right(times, start) - 1, bisect_left(times, end)
        poses = [body.pose_at(time) for time in times[max(first, 0) : last + 1]]
        return any(
            rotation_angle(a, b) > MAX_TURN_RAD or np.linalg.norm(a.translation - b.translation) > size
            for a, b in pairwise(poses)
        )


def view_findings(found: Views, where: str) -> Iterator[Finding]:
    """Yield findings on the views of the target at the prim `where`: warnings, since each may be meant, but errors
    where no picture shows the target."""
    if not is_plausible(found.size):
        smallest, largest = map(number_text, SIZES)
        message = f"the target is {size_text(found.size)}: spacecraft are {smallest} to {largest} m; check its unit"
        yield Finding(code="target-size", where=where, message=message, severity=WARNING)
    unseen = found.count(ViewKind.BEHIND, ViewKind.OUTSIDE) == found.pictures
    for kind in (kind for kind in found.of if kind in MESSAGES):
        severity = ERROR if unseen and kind in (ViewKind.BEHIND, ViewKind.OUTSIDE) else WARNING
        yield Finding(code=CODES[kind], where=where, message=sentence(found, kind), severity=severity)
