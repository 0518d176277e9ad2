"""The matrix of a plan: what each variant adds in passes and pictures, and about what that costs."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from spin_usd.dataset.picture.make_picture import BEAUTY_PASS
from spin_usd.dataset.picture.planned_picture import PlannedPicture
from spin_usd.dataset.plan.cost import Timings, expected_bytes, expected_work, read_measured
from spin_usd.dataset.plan.make_plan import Plan
from spin_usd.dataset.plan.wall_time import OPEN_S, Work, wall_seconds
from spin_usd.dataset.plan.work import Making, Method
from spin_usd.dataset.store.cache import MEASURED, RENDERS, held_keys
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.unfinished import WantedFiles, is_finished

MANY = 24  # variants, beyond which those in a row that cost alike share a line


@dataclass(frozen=True, kw_only=True)
class Row:
    """Of the variant `name`: pictures to make, and the label passes, renders and images (`exposures`) that none before
    it has made, in the order of the variants; seconds of one core; bytes. `variants`: how many it stands for."""

    name: str
    pictures: int
    label_passes: int
    renders: int
    exposures: int
    seconds: float
    bytes: float
    variants: int = 1

    @property
    def counts(self) -> tuple[int, ...]:
        return self.pictures, self.label_passes, self.renders, self.exposures


@dataclass(frozen=True, kw_only=True)
class Matrix:
    """One row a variant; `finished`: pictures that the dataset has already; `works`: of each picture to make, in their
    order; `images`: whether any shows a planet."""

    rows: tuple[Row, ...]
    finished: int
    works: tuple[Work, ...]
    images: bool

    @property
    def total(self) -> Row:
        return _sum("total", self.rows)

    def seconds(self, workers: int, cores: int) -> float:
        """About the wall-clock time of a run with so many workers on so many cores; none where nothing is left."""
        return wall_seconds(
            self.works,
            planned=self.finished + len(self.works),
            variants=sum(row.pictures > 0 for row in self.rows),
            images=self.images,
            workers=workers,
            cores=cores,
        )

    def as_json(self) -> dict[str, Any]:
        total = {name: value for name, value in _json(self.total).items() if name != "name"}
        return {**total, "finished": self.finished, "rows": [_json(row) for row in self.rows]}


def _json(row: Row) -> dict[str, Any]:
    values = {name: value for name, value in asdict(row).items() if name not in ("seconds", "variants")}
    return {**values, "bytes": round(row.bytes), "core_seconds": row.seconds}


def matrix(
    plan: Plan, method: Method, image_suffix: str, out: Path | None = None, renders: Timings | None = None
) -> Matrix:
    """What a run would make of `plan`; of the dataset `out`, where it is given, what is missing there.

    `renders`: what some took, where the dataset has made none. Raises InputError for a dataset that a run refuses.
    """
    store = Store(root=out.absolute()) if out else None
    if store:
        store.refuse_strange()
    held = held_keys(store) if store else {}
    measured = read_measured(store.cache / MEASURED) if store else Timings()
    if renders and not measured.knows(BEAUTY_PASS):
        measured.add(renders.expected, renders.taken)
    wanted = WantedFiles(kinds=method.kinds, image_suffix=image_suffix)
    todo = [picture for picture in plan.pictures if not (store and is_finished(store, picture, wanted))]
    labelled = set.intersection(*(held.get(kind, set()) for kind in method.labels)) if method.labels else set()
    rendered, exposed = set(held.get(RENDERS, set())), set[str]()
    by_variant = {name: list(pictures) for name, pictures in groupby(todo, key=lambda picture: picture.variant)}
    rows: list[Row] = []
    works: list[Work] = []
    for variant in plan.variants:
        pictures = by_variant.get(variant, [])
        before = len(exposed)
        makings = [_making(picture, method, labelled, rendered) for picture in pictures]
        if method.lit:
            exposed.update(picture.exposure for picture in pictures)
        new = [Work.of(measured.scaled(expected_work(making, method))) for making in makings]
        works += new
        rows.append(_row(variant, makings, method, new, exposures=len(exposed) - before))
    images = method.lit and any("planet" in picture.features for picture in todo)
    return Matrix(rows=tuple(rows), finished=len(plan.pictures) - len(todo), works=tuple(works), images=images)


def in_lines(rows: Sequence[Row]) -> list[Row]:
    """Rows as they are shown: of many, those in a row with the same counts as one, with their sums."""
    if len(rows) <= MANY:
        return list(rows)
    return list(_merged(rows))


def _merged(rows: Sequence[Row]) -> Iterator[Row]:
    for _, group in groupby(rows, key=lambda row: row.counts):
        alike = list(group)
        name = f"{alike[0].name} to {alike[-1].name}" if len(alike) > 1 else alike[0].name
        yield _sum(name, alike)


def _making(picture: PlannedPicture, method: Method, labelled: set[str], rendered: set[str]) -> Making:
    """How the picture is made when what the two sets name is there already; they take what it makes."""
    label_pass = bool(method.labels) and picture.geometry not in labelled
    render = method.lit and picture.radiance not in rendered
    labelled.add(picture.geometry)
    rendered.add(picture.radiance)
    return Making(picture=picture, label_pass=label_pass, render=render)


def _row(name: str, makings: Sequence[Making], method: Method, works: Sequence[Work], *, exposures: int) -> Row:
    return Row(
        name=name,
        pictures=len(makings),
        label_passes=sum(making.label_pass for making in makings),
        renders=sum(making.render for making in makings),
        exposures=exposures,
        seconds=OPEN_S * bool(makings) + sum(work.total for work in works),
        bytes=sum(expected_bytes(making, method) for making in makings),
    )


def _sum(name: str, rows: Sequence[Row]) -> Row:
    def of(field: str) -> Any:
        return sum(getattr(row, field) for row in rows)

    empty = Row(name=name, pictures=0, label_passes=0, renders=0, exposures=0, seconds=0.0, bytes=0.0)
    return replace(empty, **{field: of(field) for field in asdict(empty) if field != "name"})
