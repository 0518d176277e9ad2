"""A table of a plan: the passes and pictures that each variant adds, and their approximate cost."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from spin_usd.picture.kinds import BEAUTY_PASS
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import Timings, expected_bytes, expected_work, read_measured
from spin_usd.planning.machine_speed import slower_by
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.wall_time import OPEN_S, wall_seconds
from spin_usd.planning.work import CommonWork, PictureWork, Work
from spin_usd.store.cache import MEASURED, RENDERS, held_keys
from spin_usd.store.dataset_folder import Store
from spin_usd.store.pictures_left import WantedFiles, is_finished

MANY = 24  # variants, beyond which those in a row that cost alike share a line


@dataclass(frozen=True, kw_only=True)
class VariantRow:
    """The work of a variant: seconds of one core, and bytes.

    Label passes, renders and images (`exposures`) count only if no variant before has made them.
    """

    name: str
    pictures: int
    label_passes: int
    renders: int
    exposures: int
    seconds: float
    bytes: float
    variants: int = 1
    """Variants in this row."""

    @property
    def counts(self) -> tuple[int, ...]:
        return self.pictures, self.label_passes, self.renders, self.exposures


@dataclass(frozen=True, kw_only=True)
class VariantTable:
    """One row a variant."""

    rows: tuple[VariantRow, ...]
    finished: int
    """Pictures that the dataset has already."""
    works: tuple[Work, ...]
    """Work of each picture to make, in their order."""
    slower: float
    """Factor by which this machine is slower than the one of the constants."""
    measured: tuple[str, ...]
    """Kinds of work whose time was measured by runs instead."""

    @property
    def total(self) -> VariantRow:
        return _sum("total", self.rows)

    def seconds(self, workers: int, cores: int) -> float:
        """Return the approximate wall-clock time, seconds, of a run with these workers on these cores; 0 if nothing is
        left."""
        return wall_seconds(
            self.works,
            planned=self.finished + len(self.works),
            variants=sum(row.pictures > 0 for row in self.rows),
            workers=workers,
            cores=cores,
            slower=self.slower,
        )


def variant_table(
    plan: Plan, options: CommonWork, wanted: WantedFiles, out: Path | None = None, renders: Timings | None = None
) -> VariantTable:
    """Return the work of a run of `plan`; with `out`, only the work that is missing in that dataset.

    `renders`: measured costs of renders, for a dataset that has none. Raises InputError for a dataset that a run
    refuses.
    """
    store = Store(root=out.absolute()) if out else None
    if store:
        store.refuse_special_files()
    held = held_keys(store) if store else {}
    measured = read_measured(store.folder, MEASURED) if store else Timings()
    if renders and not measured.has_measured(BEAUTY_PASS):
        measured.add(renders.expected, renders.taken)
    todo = [picture for picture in plan.pictures if not (store and is_finished(store, picture, wanted))]
    labelled = {kind: set(held.get(kind, set())) for kind in options.labels}
    rendered, exposed = set(held.get(RENDERS, set())), set[str]()
    by_variant = {name: list(pictures) for name, pictures in groupby(todo, key=lambda picture: picture.variant)}
    rows: list[VariantRow] = []
    works: list[Work] = []
    slower = slower_by(plan.trial_s)
    costs = _Costs(options, measured, slower)
    for variant in plan.variants:
        pictures = by_variant.get(variant, [])
        before = len(exposed)
        tasks = [_task(picture, options, labelled, rendered) for picture in pictures]
        if options.renders:
            exposed.update(picture.exposure for picture in pictures)
        new = [costs.of(task) for task in tasks]
        works += [work for work, _ in new]
        rows.append(_row(variant, tasks, new, exposures=len(exposed) - before, slower=slower))
    return VariantTable(
        rows=tuple(rows),
        finished=len(plan.pictures) - len(todo),
        works=tuple(works),
        slower=slower,
        measured=tuple(work for work in measured.expected if measured.has_measured(work)),
    )


class _Costs:
    """The costs of tasks, computed once for tasks of equal cost, such as a frame's in most variants."""

    def __init__(self, options: CommonWork, measured: Timings, slower: float) -> None:
        self._options, self._measured, self._slower = options, measured, slower
        self._known: dict[tuple[object, ...], tuple[Work, float]] = {}

    def of(self, task: PictureWork) -> tuple[Work, float]:
        """Return the work of `task`, and its bytes on disk."""
        picture = task.picture
        pixels = (picture.region, picture.target_pixels)
        of = (pixels, picture.light_groups, picture.features, task.label_pass, task.render)
        found = self._known.get(of)
        if found is None:
            work = Work.of(self._measured.scaled(expected_work(task, self._options), self._slower))
            found = self._known[of] = work, expected_bytes(task, self._options)
        return found


def in_lines(rows: Sequence[VariantRow]) -> list[VariantRow]:
    """Return rows to show: among many, neighbours with the same counts become one, with their sums."""
    if len(rows) <= MANY:
        return list(rows)
    return list(_merged(rows))


def _merged(rows: Sequence[VariantRow]) -> Iterator[VariantRow]:
    for _, group in groupby(rows, key=lambda row: row.counts):
        alike = list(group)
        name = f"{alike[0].name} to {alike[-1].name}" if len(alike) > 1 else alike[0].name
        yield _sum(name, alike)


def _task(
    picture: PlannedPicture, options: CommonWork, labelled: dict[str, set[str]], rendered: set[str]
) -> PictureWork:
    """Return how the picture is made, given the existing labels and renders with these keys, and add its own to
    them."""
    label_pass, render = False, options.renders and picture.radiance not in rendered
    for kind, made in labelled.items():
        key = picture.label_key(kind)
        label_pass = label_pass or key not in made
        made.add(key)
    rendered.add(picture.radiance)
    return PictureWork(picture=picture, label_pass=label_pass, render=render)


def _row(
    name: str, tasks: Sequence[PictureWork], costs: Sequence[tuple[Work, float]], *, exposures: int, slower: float
) -> VariantRow:
    return VariantRow(
        name=name,
        pictures=len(tasks),
        label_passes=sum(task.label_pass for task in tasks),
        renders=sum(task.render for task in tasks),
        exposures=exposures,
        seconds=slower * OPEN_S * bool(tasks) + sum(work.total for work, _ in costs),
        bytes=sum(size for _, size in costs),
    )


def _sum(name: str, rows: Sequence[VariantRow]) -> VariantRow:
    def of(field: str) -> Any:
        return sum(getattr(row, field) for row in rows)

    empty = VariantRow(name=name, pictures=0, label_passes=0, renders=0, exposures=0, seconds=0.0, bytes=0.0)
    return replace(empty, **{field: of(field) for field in vars(empty) if field != "name"})
