"""`spin-usd plan`: the matrix of what a render would make, and about what that costs."""

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from spin_usd.cli.options import Json
from spin_usd.cli.progress import shown
from spin_usd.cli.request import show_doubts, with_request

if TYPE_CHECKING:
    from spin_usd.dataset.plan.make_plan import Plan
    from spin_usd.dataset.plan.variant_table import Matrix, Row

NAMED = 6  # variants at the most that are told by name
HEADINGS = ("variant", "pictures", "label passes", "renders", "exposures", "time", "disk")


@with_request
def plan(
    context: typer.Context,
    *,
    out: Annotated[Path | None, typer.Option(help="A dataset: plan what is missing of it.")] = None,
    request: Any,
    explain: Annotated[
        bool, typer.Option("--explain", help="What is left out because no picture needs it, and why.")
    ] = False,
    as_json: Json = False,
) -> None:
    """What a render would make and cost: pictures, label passes, renders and exposures that each variant adds."""
    from spin_usd.dataset.plan.effort_choice import doubts
    from spin_usd.dataset.plan.measured_cost import measured_beside
    from spin_usd.dataset.plan.variant_table import matrix
    from spin_usd.dataset.process.processors import usable_cpus
    from spin_usd.dataset.render import render as rendering
    from spin_usd.dataset.render import same_stage
    from spin_usd.dataset.render.orphans import foreign_pictures, in_words
    from spin_usd.dataset.store.dataset_folder import Store
    from spin_usd.scene.derived.view_text import sentences, summary

    with shown(context.obj["quiet"]) as progress:
        found = rendering.plan(request, progress=progress, explain=explain)
    method = rendering.method_of(request, found)
    renders, damage = measured_beside(request.stage, found, method)
    cost = matrix(found, method, request.image_suffix, out, renders)
    foreign = foreign_pictures(Store(root=out.absolute()), found) if out else []
    other = same_stage.other_origin(Store(root=out.absolute()), found) if out else ()
    workers = rendering.default_workers()
    seconds = cost.seconds(workers, len(usable_cpus()))
    remarks = sentences(found.views) if found.views else []
    notes = [*doubts(request.chosen, found.stages), *damage, *found.notes, *remarks]
    show_doubts(notes)
    if as_json:
        hashes = {name: stage["hash"] for name, stage in found.stages.items()}
        wall = {"workers": workers, "wall_seconds": seconds, "foreign": len(foreign), "other_stage": other}
        chosen = request.chosen.as_json(found.stages) if request.chosen else None
        effort = {"renderer": request.renderer, "effort": asdict(request.effort), "chosen": chosen, "notes": notes}
        views = {"views": found.views.as_json()} if found.views else {}
        left_out = {"left_out": [asdict(each) for each in found.spared]} if explain else {}
        print(
            json.dumps(
                {**cost.as_json(), **wall, **effort, "variants": found.variants, "hashes": hashes, **views, **left_out}
            )
        )
        return
    print(table(cost))
    if found.views:
        print(summary(found.views))
    if request.chosen:
        print(request.chosen.reason)
    if out:
        print(f"already made: {cost.finished} pictures")
    if other:
        print(f"note: {out} {same_stage.in_words(other)}; a render needs --replace, or another folder")
    if foreign:
        print(f"note: {out} {in_words(foreign)}; a render needs --prune, which removes them, or another folder")
    total = cost.total
    print(f"about {_duration(seconds)} with {workers} workers, {_size(total.bytes)} on disk")
    if explain:
        print(explanation(found))


def explanation(found: "Plan") -> str:
    """What is left out, why, how surely nothing changes, and of which pictures."""
    from spin_usd.dataset.plan.skipped_work import KEPT

    planned = Counter(picture.variant for picture in found.pictures)
    lines = [
        f"{each.part}: no {each.what}: {each.why} ({each.same}; {_pictures(each.pictures, planned)})"
        for each in found.spared
    ]
    return "\n".join(("left out, because the pictures do not need it:", *lines, KEPT))


def _pictures(counts: Mapping[str, int], planned: Mapping[str, int]) -> str:
    """Which pictures, of those that are `planned` of each variant."""
    if counts == planned:
        return "all pictures"
    if len(counts) > NAMED:
        return f"{sum(counts.values())} of {sum(planned.values())} pictures, of {len(counts)} variants"
    return ", ".join(f"{count} of {planned[variant]} of {variant}" for variant, count in counts.items())


def table(cost: "Matrix") -> str:
    """The matrix in aligned columns: counts are of what no variant above has made; time is of one core."""
    from spin_usd.accuracy.tables import in_columns
    from spin_usd.dataset.plan.variant_table import in_lines

    return in_columns(HEADINGS, [_cells(row) for row in (*in_lines(cost.rows), cost.total)])


def _cells(row: "Row") -> tuple[str, ...]:
    name = f"{row.name} ({row.variants} variants)" if row.variants > 1 else row.name
    return name, *(str(count) for count in row.counts), _duration(row.seconds), _size(row.bytes)


def _size(count: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"


def _duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
