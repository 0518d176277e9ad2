"""Sampled variants of a stage."""

from pathlib import Path
from typing import Any

from spin_usd.api.checked import checked
from spin_usd.dataset.author.reports import AugmentReport
from spin_usd.dataset.process.ask_child import ask_child
from spin_usd.dataset.process.child import Child
from spin_usd.dataset.store.stage_path import existing_stage
from spin_usd.progress import Progress


@checked
def augment(
    stage: str | Path, *, spec: str | Path, out: str | Path | None = None, on_progress: Progress | None = None
) -> AugmentReport:
    """Write a specification's augmentations over a stage, one variant each. Run again, it replaces its own.

    Args:
        stage: a stage's root layer, or the folder of its dataset.usda.
        spec: a specification's name, or a TOML file.
        out: a new root layer beside the stage, which then stays as it is.
        on_progress: called with what is counted, how many are done and how many there are.

    Raises InputError that names the specification, the augmentation and what is wrong in it; then nothing is written.
    """
    root = existing_stage(Path(stage))
    report = ask_child(
        "augment",
        reads=f"{root} or {spec}",
        progress=on_progress,
        stage=str(root),
        spec=str(spec),
        out=None if out is None else str(out),
    )
    return AugmentReport.from_json(report)


def parameters() -> list[dict[str, Any]]:
    """List the parameters that a specification can sample, each with its name, description, units and limits."""
    with Child() as child:
        found: list[dict[str, Any]] = child.call("parameter_list")
    return found
