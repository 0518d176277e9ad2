"""The report that `plan` returns."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from msgspec import UNSET, Meta, UnsetType
from msgspec.structs import asdict

from spin_usd.accuracy.measurement import Configuration, Measurement
from spin_usd.basics.json_fields import Count, JsonStruct, Positive, Sha256, Size
from spin_usd.commands.render.workers import default_workers
from spin_usd.errors import InputError
from spin_usd.picture.kinds import BEAUTY_PASS
from spin_usd.planning.cost import Timings, expected_work
from spin_usd.planning.effort_choice import Chosen, Expected, doubts
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.orphans import orphaned_pictures
from spin_usd.planning.render_plan import common_work
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.same_stage import other_origin
from spin_usd.planning.skipped_counts import SkippedCount
from spin_usd.planning.variant_table import VariantRow, VariantTable, variant_table
from spin_usd.planning.work import CommonWork, PictureWork
from spin_usd.processes.devices import AUTO
from spin_usd.processes.processors import machine, usable_cpus
from spin_usd.records.record import EffortChoice, StageProvenance
from spin_usd.scene.derived.view_text import sentences
from spin_usd.scene.derived.views import Views
from spin_usd.scene.effort import CPU, Effort
from spin_usd.store.dataset_folder import Store
from spin_usd.store.measurement_file import FILE, folder_of, measurement_file, read_measurement
from spin_usd.store.pictures_left import WantedFiles


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanReport:
    """The pictures that a render would make, and their approximate cost."""

    cost: VariantTable
    """A row for each variant, and their total."""
    pictures: Mapping[str, int]
    """How many are planned of each variant."""
    workers: int
    """How many processes a render would start."""
    seconds: float
    """About the wall-clock time with these workers."""
    renderer: str
    """Renderer name."""
    device: str
    """Device the renderer runs on."""
    effort: Effort
    """The settings that it has."""
    chosen: Chosen | None
    """Why it is that effort; None where it was given."""
    stages: Mapping[str, StageProvenance]
    """Provenance of the stage by variant."""
    views: Views | None
    """Summary of what the pictures show, if known."""
    notes: tuple[str, ...]
    """Notes for the user."""
    skipped: tuple[SkippedCount, ...] | None
    """The work that no picture needs; None if not requested."""
    orphans: tuple[str, ...]
    """Records in the dataset of pictures that the stage does not have."""
    other_stage: tuple[str, ...]
    """The inputs and options in which the stage of the dataset's pictures differs from this one."""

    @property
    def document(self) -> "PlanDocument":
        """Output of `plan --json`."""
        total = self.cost.total
        return PlanDocument(
            pictures=total.pictures,
            label_passes=total.label_passes,
            renders=total.renders,
            exposures=total.exposures,
            bytes=round(total.bytes),
            core_seconds=total.seconds,
            finished=self.cost.finished,
            rows=[_row(row) for row in self.cost.rows],
            workers=self.workers,
            wall_seconds=self.seconds,
            speed=PlannedSpeed(slower=self.cost.slower, measured=self.cost.measured),
            orphans=len(self.orphans),
            other_stage=self.other_stage,
            renderer=self.renderer,
            device=self.device,
            effort=self.effort,
            chosen=planned_choice(self.chosen, self.stages) if self.chosen else None,
            notes=self.notes,
            variants=tuple(self.pictures),
            hashes={name: stage.hash for name, stage in self.stages.items()},
            views=self.views,
            skipped=self.skipped,
        )


class PlannedVariant(JsonStruct, frozen=True, kw_only=True):
    """The work of a render for a variant, and its approximate cost."""

    name: Annotated[str, Meta(description="The variant.")]
    pictures: Count
    label_passes: Count
    renders: Count
    exposures: Count
    bytes: Count
    core_seconds: Size


class PlannedSpeed(JsonStruct, frozen=True, kw_only=True):
    """Where the seconds are from."""

    slower: Annotated[
        Positive,
        Meta(description="Times that this machine takes as long as the one of the published costs, by a trial."),
    ]
    measured: Annotated[
        tuple[str, ...],
        Meta(description="Kinds of work timed by earlier runs instead, of this dataset or of `measure`."),
    ]


class PlannedChoice(EffortChoice, frozen=True, kw_only=True):
    """Why the effort is this."""

    expected: Annotated[Expected | UnsetType, Meta(description="Figures of the settings, as measured.")] = UNSET


class PlanDocument(JsonStruct, frozen=True, kw_only=True, omit_defaults=True, tag_field="schema", tag="plan-report-1"):
    """Output of spin-usd plan --json."""

    pictures: Annotated[Count, Meta(description="How many a render would make.")]
    label_passes: Count
    renders: Count
    exposures: Count
    bytes: Annotated[Count, Meta(description="Approximate size on disk.")]
    core_seconds: Annotated[Size, Meta(description="About the seconds of one core.")]
    finished: Annotated[Count, Meta(description="Pictures that the dataset of --out has already.")]
    rows: Annotated[list[PlannedVariant], Meta(description="The same for each variant.")]
    workers: Annotated[int, Meta(ge=1, description="Processes that a render would start.")]
    wall_seconds: Annotated[Size, Meta(description="About the wall-clock time with them.")]
    speed: PlannedSpeed
    orphans: Annotated[Count, Meta(description="Records in the dataset of pictures that the stage does not have.")]
    other_stage: Annotated[
        tuple[str, ...], Meta(description="Differences between this stage and the stage of the dataset's pictures.")
    ]
    renderer: str
    device: str
    effort: Annotated[Effort, Meta(description="Settings of the renderer, as in a record.")]
    chosen: Annotated[PlannedChoice | None, Meta(description="Null where they were given, or are the default.")]
    notes: Annotated[tuple[str, ...], Meta(description="Notes for the user.")]
    variants: tuple[str, ...]
    hashes: Annotated[dict[str, Sha256], Meta(description="Composed content, by variant, as in a record's provenance.")]
    views: Views | None = None
    skipped: Annotated[
        tuple[SkippedCount, ...] | None,
        Meta(description="Work that is skipped because no picture needs it; only with --explain."),
    ] = None


def _row(row: VariantRow) -> PlannedVariant:
    return PlannedVariant(
        name=row.name,
        pictures=row.pictures,
        label_passes=row.label_passes,
        renders=row.renders,
        exposures=row.exposures,
        bytes=round(row.bytes),
        core_seconds=row.seconds,
    )


def planned_choice(chosen: Chosen, stages: Mapping[str, StageProvenance]) -> PlannedChoice:
    """Return the choice as recorded, with the expected error; for a quality only if one of the `stages`, by variant, is
    the measured one."""
    applies = chosen.by == "error" or chosen.is_of(stages)
    expected = chosen.expected if applies and chosen.expected else UNSET
    return PlannedChoice(**asdict(chosen.recorded), expected=expected)


def report_of(request: RenderRequest, plan: Plan, dataset: Path | None, *, explained: bool) -> PlanReport:
    """Return the report on the `plan` of a `request`, for the folder `dataset` if that is given. explained: whether the
    plan lists the skipped work."""
    options = common_work(request, plan)
    renders, damage = measured_beside(request.stage, plan, options)
    recorded, suffix = request.options.recorded, request.image_suffix
    wanted = WantedFiles(kinds=options.kinds, options=recorded, image_suffix=suffix)
    cost = variant_table(plan, options, wanted, dataset, renders)
    store = Store(root=dataset) if dataset else None
    counts = Counter(picture.variant for picture in plan.pictures)
    workers = default_workers()
    remarks = sentences(plan.views) if plan.views else []
    return PlanReport(
        cost=cost,
        pictures={variant: counts[variant] for variant in plan.variants},
        workers=workers,
        seconds=cost.seconds(workers, len(usable_cpus())),
        renderer=request.renderer,
        device=plan.settings.device,
        effort=request.effort,
        chosen=request.chosen,
        stages=plan.stages,
        views=plan.views,
        notes=(*doubts(request.chosen, plan.stages), *damage, *_of_device(request, plan), *plan.notes, *remarks),
        skipped=plan.skipped if explained else None,
        orphans=tuple(orphaned_pictures(store, plan)) if store else (),
        other_stage=other_origin(store, plan) if store else (),
    )


def _of_device(request: RenderRequest, plan: Plan) -> Iterator[str]:
    """Yield notes on the device that renders the light, if not given, and on its unknown cost."""
    device = plan.settings.device
    if request.device == AUTO:
        yield f"--device auto: light is rendered on {device}"
    if device != CPU:
        yield f"the cost of light on {device} was measured on an NVIDIA H200"


def measured_beside(stage: Path, plan: Plan, options: CommonWork) -> tuple[Timings, list[str]]:
    """Return the timings of the measurement beside the stage, none if it is not of this stage on this machine; and
    notes on its faults, if it cannot be used."""
    if not (folder_of(stage) / FILE).exists():
        return Timings(), []
    try:
        measurement = read_measurement(measurement_file(stage))
    except InputError as e:
        return Timings(), [f"the measurement beside the stage is not used: {e}"]
    known = plan.stages.get(measurement.variant)
    if known is None or known.hash != measurement.stage or dict(measurement.machine) != machine():
        return Timings(), []
    return measured_renders(measurement, plan, options), []


def measured_renders(measurement: Measurement, plan: Plan, options: CommonWork) -> Timings:
    """Return the timings of planned pictures that were measured, on the CPU, with the given options."""
    setting, found = Configuration(renderer=options.renderer, effort=options.effort), Timings()
    if options.device != CPU:
        return found
    cpu_s = {figures.frame: figures.cpu_s for figures in measurement.figures if figures.setting == setting}
    for picture in plan.pictures:
        if picture.variant == measurement.variant and picture.frame in cpu_s:
            expected = expected_work(PictureWork(picture=picture, label_pass=False, render=True), options)
            found.add({BEAUTY_PASS: expected[BEAUTY_PASS]}, {BEAUTY_PASS: cpu_s[picture.frame]})
    return found
