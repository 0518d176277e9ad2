"""Plan a render: list what it would make and what that would cost."""

from pathlib import Path

from spin_usd.commands.plan.options import PlanOptions
from spin_usd.commands.plan.report import PlanReport, report_of
from spin_usd.commands.render import request as rendering
from spin_usd.options import takes
from spin_usd.planning.request import RenderRequest
from spin_usd.store.dataset_folder import Store


@takes(PlanOptions)
def plan(options: PlanOptions) -> PlanReport:
    """Say what a render would make and cost: pictures, label passes, renders and images that each variant adds.

    Raises as `render` does; writes nothing but how fast this machine is, once, into the user's cache folder.
    """
    request = RenderRequest.of(options)
    dataset = None if options.out is None else Path(options.out).absolute()
    had = Store(root=dataset).kinds if dataset else ()
    found = rendering.plan(request, progress=options.progress, explain=options.explain, had=had, timed=True)
    return report_of(request, found, dataset, explained=options.explain)
