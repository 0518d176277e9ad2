"""The report that `plan` returns."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from spin_usd.commands.render.orphans import orphaned_pictures
from spin_usd.commands.render.request import common_work
from spin_usd.commands.render.same_stage import other_origin
from spin_usd.commands.render.workers import default_workers
from spin_usd.planning.effort_choice import Chosen, doubts
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.measured_cost import measured_beside
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.skipped_work import SkippedCount
from spin_usd.planning.variant_table import VariantTable, variant_table
from spin_usd.processes.devices import AUTO
from spin_usd.processes.processors import usable_cpus
from spin_usd.scene.derived.view_text import sentences
from spin_usd.scene.derived.views import Views
from spin_usd.scene.effort import CPU, Effort
from spin_usd.store.dataset_folder import Store


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanReport:
    """The pictures that a render would make, and about what they cost.

    cost: a row for each variant, and their total · pictures: how many are planned of each variant · workers: processes
    that a render would start · seconds: about the wall-clock time with them · renderer, device, effort: how the
    pictures are made · chosen: why with that effort, None where it was given · stages: by variant, what a record says
    of the stage · views: what the pictures show, where that is known · notes: sentences on what a user should know ·
    skipped: the work that no picture needs, None where it was not asked for · orphans: records in the dataset of
    pictures that the stage does not have · other_stage: the inputs and options in which the stage of the dataset's
    pictures differs from this one.
    """

    cost: VariantTable
    pictures: Mapping[str, int]
    workers: int
    seconds: float
    renderer: str
    device: str
    effort: Effort
    chosen: Chosen | None
    stages: Mapping[str, Mapping[str, Any]]
    views: Views | None
    notes: tuple[str, ...]
    skipped: tuple[SkippedCount, ...] | None
    orphans: tuple[str, ...]
    other_stage: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        report = {
            **self.cost.as_json(),
            "workers": self.workers,
            "wall_seconds": self.seconds,
            "orphans": len(self.orphans),
            "other_stage": self.other_stage,
            "renderer": self.renderer,
            "device": self.device,
            "effort": asdict(self.effort),
            "chosen": self.chosen.as_json(self.stages) if self.chosen else None,
            "notes": self.notes,
            "variants": tuple(self.pictures),
            "hashes": {name: stage["hash"] for name, stage in self.stages.items()},
        }
        if self.views:
            report["views"] = self.views.as_json()
        if self.skipped is not None:
            report["skipped"] = [asdict(each) for each in self.skipped]
        return report


def report_of(request: RenderRequest, plan: Plan, dataset: Path | None, *, explained: bool) -> PlanReport:
    """Return the report on the `plan` of a `request`, for the folder `dataset` if that is given. explained: whether the
    plan lists the skipped work."""
    options = common_work(request, plan)
    renders, damage = measured_beside(request.stage, plan, options)
    cost = variant_table(plan, options, request.image_suffix, dataset, renders)
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
    """Yield which device renders the light, where that was not said, and what is not known of it."""
    device = plan.settings.device
    if request.device == AUTO:
        yield f"--device auto: light is rendered on {device}"
    if device != CPU:
        yield f"what a picture costs on {device} is not known: times are those of the CPU"
