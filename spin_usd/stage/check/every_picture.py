"""Rules on what the pictures need: every picture of every variant is read as for a render."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from pxr import Usd

from spin_usd.errors import SpinError
from spin_usd.progress import Progress
from spin_usd.scene.derived.views import ViewCollector, Views
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.scene.target import Target
from spin_usd.stage.check.blended_poses import BlendedPoses
from spin_usd.stage.check.identical_variants import IdenticalVariants
from spin_usd.stage.check.refusals import refusals
from spin_usd.stage.check.views import view_findings
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.open_stage import open_stage, variants
from spin_usd.stage.read.numbering import Numbering
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd.parser_faults import parser_faults

MAX_VARIANTS = 200  # of one set; each is composed and read
READING = "reading: picture"
PROGRESS_EVERY = 500

TargetRule = Callable[[Target], Iterator[Finding]]
"""A rule on a body's shape."""
OnViews = Callable[[Views], None]
"""Called with the views of a stage's own pictures, those of its first variant."""


def scene_findings(
    path: str | Path, stage: Usd.Stage, *, progress: Progress, target_rule: TargetRule, on_views: OnViews
) -> Iterator[Finding]:
    """Yield the errors that a render of the stage at `path` would raise: for each variant the first picture that cannot
    be read, and all that is wrong there, as the readers report it. What variants share is reported once, for the first;
    the findings of `target_rule` once for each shape of a body. `on_views` receives the views of the pictures.

    `stage`: the same stage as opened for checks. One that does not compose is not read: USD's validators report that.
    """
    if composition_errors(stage):
        return
    names = variants(stage)
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
                for done, frame in enumerate(reader.frames):
                    if done % PROGRESS_EVERY == 0:
                        progress(READING, index * len(reader.frames) + done, count * len(reader.frames))
                    self.picture = frame.name
                    scene = reader.scene(frame)
                    blended.add(scene)
                    for collector in seen.values():
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
        for finding in self._findings_on_views([(path, collector.views()) for path, collector in seen.items()]):
            yield from self._once(finding.code, finding.where, finding.message, "", finding.severity)

    def _findings_on_views(self, seen: Sequence[tuple[str, Views | None]]) -> Iterator[Finding]:
        """Yield findings on the views of each target, given with its path: of the first all, of others only that no
        picture shows them, for some are there to pass by."""
        (first, self.views), *others = seen
        yield from view_findings(self.views, first) if self.views else ()
        for path, views in others:
            found = view_findings(views, path) if views else ()
            yield from (finding for finding in found if finding.severity == ERROR)

    def _others(self) -> Iterator[SpinError]:
        """Yield all other errors of the variant's readers; reading a picture ended at the first of them."""
        with suppress(SpinError), parser_faults(self.path):  # a variant that cannot be opened was reported already
            yield from refusals(open_stage(self.path, variant=self.variant))

    def _once(self, code: str, where: object, found: str, do: str, severity: str = "error") -> Iterator[Finding]:
        if (str(where), found) not in self.reported:
            self.reported.add((str(where), found))
            at = f"picture {self.picture} of variant" if self.picture else "variant"
            message = f"{found}{do} ({at} {self.variant})"
            yield Finding(code=code, where=str(where), message=message, severity=severity)
