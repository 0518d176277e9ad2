"""The report of a run, and the listener that counts for it while the run goes on."""

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated

from msgspec import Meta, Struct, field

from spin_usd.basics.json_fields import Count, JsonStruct, Size, one_of
from spin_usd.basics.pluralise import pluralise
from spin_usd.basics.progress import Note, Progress
from spin_usd.commands.render.calls import MadePicture
from spin_usd.picture.brightness import WORDS
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import Timings, expected_work
from spin_usd.planning.work import CommonWork, PictureWork


class FailedPicture(JsonStruct, frozen=True, kw_only=True):
    """A picture that failed."""

    picture: Annotated[str, Meta(description="Variant and frame, such as nominal/img000001.")]
    reason: Annotated[str, Meta(description="Reason, and the command that makes the picture again.")]


class RenderReport(Struct, kw_only=True, tag_field="schema", tag="render-report-1"):
    """Output of spin-usd render --json. The exit code is 1 if a picture failed, 0 otherwise."""

    pictures: Annotated[Count, Meta(description="How many were requested.")]
    made: Annotated[Count, Meta(description="How many of them were made.")] = 0
    reused: Annotated[Count, Meta(description="How many existed already.")] = 0
    pruned: Annotated[
        Count,
        Meta(description="Pictures removed: the stage does not have them, or they were another stage's."),
    ] = 0
    label_passes: Annotated[Count, Meta(description="How many of the made ones needed a label pass of their own.")] = 0
    labels_shared: Annotated[Count, Meta(description="How many used another picture's, from the cache.")] = 0
    renders: Annotated[Count, Meta(description="How many of the made ones needed a render of their own.")] = 0
    renders_shared: Annotated[Count, Meta(description="How many used another picture's, from the cache.")] = 0
    events: Annotated[Count, Meta(description="How many variants have their events, if these were requested.")] = 0
    failed: list[FailedPicture] = []
    seconds: Annotated[Size, Meta(description="Wall-clock.")] = 0.0
    work: Annotated[dict[str, Size], Meta(description="Seconds by kind of work, over all workers.")] = {}
    doubts: Annotated[list[str], Meta(description="Doubts about the choice of the effort.")] = []
    faults: Annotated[
        dict[Annotated[str, one_of(*WORDS)], Count],
        Meta(
            description="How many pictures, made or there already, are dark, bright, or exposed as far as the camera "
            "can (picture.brightness)."
        ),
    ] = field(default_factory=lambda: dict.fromkeys(WORDS, 0))

    def add(self, faults: Iterable[str]) -> None:
        """Count the faults of one more picture."""
        for fault in faults:
            self.faults[fault] += 1


class RunListener:
    """Counts the workers' results in the report, and measures each picture's time against the expected one.

    `alone` turns a worker's seconds by kind of work into seconds of one core; `again` gives the command that makes a
    picture again; `first`, if the first picture is to be announced, the path to look at.
    """

    def __init__(
        self,
        report: RenderReport,
        progress: Progress,
        note: Note,
        options: CommonWork,
        alone: Callable[[Mapping[str, float]], Mapping[str, float]],
        again: Callable[[PlannedPicture], str],
        first: Callable[[PlannedPicture], str] | None = None,
    ) -> None:
        self.report, self.progress, self.note, self.options = report, progress, note, options
        self.alone, self.again, self.first = alone, again, first
        self.measured = Timings()

    def ready(self) -> None:
        self._report_progress()

    def done(self, picture: PlannedPicture, made: MadePicture) -> None:
        self.report.made += 1
        if self.first and self.report.made == 1:
            self.note(f"the first picture is made: {self.first(picture)}")
        self.report.add(made.faults)
        match made.passes.get("labels"):
            case "made":
                self.report.label_passes += 1
            case "shared":
                self.report.labels_shared += 1
        match made.passes.get("render"):
            case "made":
                self.report.renders += 1
            case "shared":
                self.report.renders_shared += 1
        own = {name: made.passes.get(name) == "made" for name in ("labels", "render")}
        task = PictureWork(picture=picture, label_pass=own["labels"], render=own["render"])
        self.measured.add(expected_work(task, self.options), self.alone(made.seconds))
        for work, seconds in made.seconds.items():
            self.report.work[work] = self.report.work.get(work, 0.0) + seconds
        self._report_progress()

    def failed(self, picture: PlannedPicture, reason: str) -> None:
        reason = f"{reason}; to see it again: {self.again(picture)}"
        self.report.failed.append(FailedPicture(picture=picture.name, reason=reason))
        self._report_progress()

    def stopping(self, pictures: int) -> None:
        begun = f"finishing {pluralise(pictures, 'picture')}" if pictures else "stopping"
        self.note(f"{begun}; Ctrl-C or SIGTERM now stops at once")

    def stopped(self) -> None:
        made, all_pictures = self.report.reused + self.report.made, self.report.pictures
        self.note(f"{made} of {all_pictures} pictures are made; {all_pictures - made} are missing")

    def _report_progress(self) -> None:
        report = self.report
        self.progress("rendering: picture", report.reused + report.made + len(report.failed), report.pictures)
