"""`spin-usd check`: prints what is wrong with a stage or a dataset."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

import spin_usd
from spin_usd.cli.options import Json
from spin_usd.cli.output.counted import counted
from spin_usd.cli.output.lines import show
from spin_usd.cli.output.notes import show_notes
from spin_usd.cli.output.progress import shown
from spin_usd.errors import FINDINGS


def check(
    context: typer.Context,
    path: Annotated[Path, typer.Argument(help="A stage or a dataset.")],
    repair: Annotated[
        bool,
        typer.Option(
            "--repair",
            help="First make again what a dataset lacks or what is damaged in it, from its own copy of the stage. "
            "(render --verify does so from the stage that it is given.)",
        ),
    ] = False,
    cross: Annotated[
        bool,
        typer.Option(
            "--cross",
            help="Also cast a dataset's labels again through Cycles, which has no part in making them, and find where "
            "they differ: some 0.3 s a picture.",
        ),
    ] = False,
    cross_pictures: Annotated[
        int | None,
        typer.Option("--cross-pictures", metavar="N", help="With --cross: of so many pictures, evenly spread."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Look for what is wrong with a stage or a dataset: conventions, schemas, digests, label consistency."""
    from spin_usd.scene.derived.view_text import summary

    with shown(context.obj["quiet"]) as progress:
        checked = spin_usd.check(
            path,
            repair=repair,
            cross=cross,
            cross_pictures=cross_pictures,
            on_progress=progress,
            on_note=lambda note: show_notes([note]),
        )
    findings, views = checked.findings, checked.views
    errors = [finding for finding in findings if finding.severity == "error"]
    if as_json:
        more: dict[str, Any] = {"views": views.as_json()} if views else {}
        more |= {name: getattr(checked, name) for name in ("repaired", "unrepaired") if repair}
        more |= {"compared": checked.compared} if cross else {}
        show(json.dumps({"kind": checked.kind, "findings": [asdict(finding) for finding in findings], **more}))
    else:
        for name in ("repaired", "unrepaired") if repair else ():
            for what in getattr(checked, name):
                show(f"{name}: {what}")
        if views:
            show(*summary(views).split("\n"))
        for finding in findings:
            show(f"{finding.severity}: {finding.where}: {finding.message} [{finding.code}]")
        if checked.compared is not None:
            show(f"compared with Cycles: {counted(checked.compared, 'picture')}")
        warnings = counted(len(findings) - len(errors), "warning")
        show(f"{checked.kind} {path}: {counted(len(errors), 'error')}, {warnings}")
    if errors:
        raise typer.Exit(FINDINGS)
