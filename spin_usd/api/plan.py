"""Plan a render: list what it would make and what that would cost."""

from collections.abc import Sequence
from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.api.plan_report import PlanReport, report_of
from spin_usd.api.request import render_request
from spin_usd.dataset.render import request as rendering
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.progress import Progress, ignore
from spin_usd.scene.effort import CPU


@checked
def plan(
    stage: str | Path,
    *,
    out: str | Path | None = None,
    frames: str | None = None,
    variants: str | Sequence[str] = (),
    samples: int | None = None,
    effort: str | None = None,
    quality: str | None = None,
    error: str | float | None = None,
    measured: str | Path | None = None,
    seed: int | None = None,
    labels: str | Sequence[str] = "default",
    labels_only: bool = False,
    renderer: str | None = None,
    device: str = CPU,
    radiance: bool = False,
    image_format: str = "png",
    explain: bool = False,
    on_progress: Progress | None = None,
) -> PlanReport:
    """Say what a render would make and cost: pictures, label passes, renders and images that each variant adds.

    Args:
        out: a dataset's folder: plan what is missing of it.
        explain: also list the work that is skipped because no picture needs it.

    All other arguments are those of `render`. Raises as `render` does; writes nothing.
    """
    request = render_request(
        stage,
        frames=frames,
        variants=variants,
        samples=samples,
        effort=effort,
        quality=quality,
        error=error,
        measured=measured,
        seed=seed,
        labels=labels,
        labels_only=labels_only,
        renderer=renderer,
        device=device,
        radiance=radiance,
        image_format=image_format,
    )
    dataset = None if out is None else Path(out).absolute()
    had = Store(root=dataset).kinds if dataset else ()
    found = rendering.plan(request, progress=ignore if on_progress is None else on_progress, explain=explain, had=had)
    return report_of(request, found, dataset, explained=explain)
