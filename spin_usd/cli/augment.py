"""`spin-usd augment`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from spin_usd.cli.counted import counted
from spin_usd.cli.options import Json, Stage
from spin_usd.cli.progress import shown

MOST_LISTED = 10


def augment(
    context: typer.Context,
    stage: Stage,
    spec: Annotated[str, typer.Option(metavar="NAME_OR_FILE", help="A built-in specification's name, or a TOML file.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A new root layer beside the stage, which stays as it is.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a specification's augmentations over a stage: one variant each. Run again, it replaces them."""
    from spin_usd.dataset.child import Child, stage_memory

    with shown(context.obj["quiet"]) as progress, Child(memory=stage_memory()) as child:
        report = child.call(
            "augment",
            progress=lambda told: progress(*told),
            stage=str(stage),
            spec=spec,
            out=str(out) if out else None,
        )
    if as_json:
        print(json.dumps(report))
        return
    names = report["augmentations"]
    listed = ", ".join(names if len(names) <= MOST_LISTED else [*names[: MOST_LISTED - 1], "...", names[-1]])
    print(f"{report['root']}   ({counted(len(names), 'augmentation')} of {report['spec']}: {listed})")
