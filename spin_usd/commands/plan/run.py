"""Plan a render: list its work and its cost."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from spin_usd.basics.pluralise import duration, pluralise
from spin_usd.basics.progress import Progress
from spin_usd.commands.plan.options import PlanOptions
from spin_usd.commands.plan.report import PlanReport, report_of
from spin_usd.events.calls import COUNT_STEPS, CountSteps
from spin_usd.options import takes
from spin_usd.picture.planned_picture import places_of
from spin_usd.planning import render_plan
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.request import RenderRequest
from spin_usd.processes.ask_child import ask_child
from spin_usd.store.dataset_folder import Store


@takes(PlanOptions)
def plan(options: PlanOptions) -> PlanReport:
    """Estimate what a render would make and cost: pictures, label passes, renders and images of each variant.

    Raises like `render`; writes nothing except the speed of this machine, once, into the user's cache folder.
    """
    request = RenderRequest.of(options)
    dataset = None if options.out is None else Path(options.out).absolute()
    had = Store(root=dataset).kinds if dataset else ()
    found = render_plan.plan(request, progress=options.progress, explain=options.explain, had=had, timed=True)
    report = report_of(request, found, dataset, explained=options.explain)
    if not options.events:
        return report
    return replace(report, notes=(*report.notes, *_event_notes(request, found, report, options.progress)))


def _event_notes(request: RenderRequest, found: Plan, report: PlanReport, progress: Progress) -> Iterator[str]:
    """Yield a sentence for each variant on the cost of its events."""
    asked = CountSteps(stage=str(request.stage), pictures=places_of(found.pictures))
    counts = ask_child(COUNT_STEPS, asked, reads=request.stage, progress=progress)
    total = report.cost.total
    each = total.seconds / max(total.pictures, 1)
    for variant, of in counts.items():
        least, most = (duration(number * each) for number in (of.renders, of.steps))
        steps = f"{pluralise(of.steps, 'time step')} in {of.seconds:g} s"
        yield (
            f"the events of {variant} take {steps}; {of.renders} to {of.steps} are rendered, as highlights and "
            f"shadows move: {least} to {most} of one core if each costs as a picture does"
        )
