"""The report of a run, and the listener that counts for it while the run goes on."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from spin_usd.picture.brightness import WORDS
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import Timings, expected_work
from spin_usd.planning.work import CommonWork, Task
from spin_usd.pluralise import pluralise
from spin_usd.progress import Note, Progress


@dataclass(kw_only=True)
class RenderReport:
    """The report of what a run did.

    pictures: how many were asked for · made, reused: of those, how many were made and how many were there already ·
    pruned: pictures removed, which the stage does not have or which were another stage's · label_passes, renders: how
    many of the pictures made took one of their own · labels_shared, renders_shared: how many took another picture's
    from the cache · failed: names and reasons · seconds: wall-clock · work: seconds by kind of work, over all workers ·
    doubts: about the choice of the effort · faults: how many pictures, made or there already, have each fault that
    picture.brightness finds.
    """

    pictures: int
    made: int = 0
    reused: int = 0
    pruned: int = 0
    label_passes: int = 0
    labels_shared: int = 0
    renders: int = 0
    renders_shared: int = 0
    failed: list[tuple[str, str]] = field(default_factory=list)
    seconds: float = 0.0
    work: dict[str, float] = field(default_factory=dict)
    doubts: list[str] = field(default_factory=list)
    faults: dict[str, int] = field(default_factory=lambda: dict.fromkeys(WORDS, 0))

    def add(self, faults: Iterable[str]) -> None:
        """Count the faults of one more picture."""
        for fault in faults:
            self.faults[fault] += 1

    def as_json(self) -> dict[str, Any]:
        return asdict(self) | {"failed": [{"picture": name, "reason": reason} for name, reason in self.failed]}


class RunListener:
    """Counts in the report what workers do, and measures what each picture took beside what was expected of it.

    `alone` turns a worker's seconds by kind of work into those of one core; `again` gives the command that makes a
    picture again.
    """

    def __init__(
        self,
        report: RenderReport,
        progress: Progress,
        note: Note,
        options: CommonWork,
        alone: Callable[[Mapping[str, float]], Mapping[str, float]],
        again: Callable[[PlannedPicture], str],
    ) -> None:
        self.report, self.progress, self.note, self.options = report, progress, note, options
        self.alone, self.again = alone, again
        self.measured = Timings()

    def ready(self) -> None:
        self._report_progress()

    def done(self, picture: PlannedPicture, result: Mapping[str, Any]) -> None:
        self.report.made += 1
        self.report.add(result["faults"])
        match result["passes"].get("labels"):
            case "made":
                self.report.label_passes += 1
            case "shared":
                self.report.labels_shared += 1
        match result["passes"].get("render"):
            case "made":
                self.report.renders += 1
            case "shared":
                self.report.renders_shared += 1
        own = {name: result["passes"].get(name) == "made" for name in ("labels", "render")}
        task = Task(picture=picture, label_pass=own["labels"], render=own["render"])
        self.measured.add(expected_work(task, self.options), self.alone(result["seconds"]))
        for work, seconds in result["seconds"].items():
            self.report.work[work] = self.report.work.get(work, 0.0) + seconds
        self._report_progress()

    def failed(self, picture: PlannedPicture, reason: str) -> None:
        self.report.failed.append((picture.name, f"{reason}; to see it again: {self.again(picture)}"))
        self._report_progress()

    def stopping(self, pictures: int) -> None:
        self.note(f"finishing {pluralise(pictures, 'picture')}; Ctrl-C or SIGTERM now stops at once")

    def stopped(self) -> None:
        made, all_pictures = self.report.reused + self.report.made, self.report.pictures
        self.note(f"{made} of {all_pictures} pictures are made, {all_pictures - made} are left")

    def _report_progress(self) -> None:
        report = self.report
        self.progress("rendering: picture", report.reused + report.made + len(report.failed), report.pictures)
