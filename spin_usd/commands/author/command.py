"""`spin-usd author`: writes a stage from a pose list, from sampled poses, or as a single layer."""

import json
from pathlib import Path
from typing import Annotated

import typer
from msgspec import to_builtins

import spin_usd
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.author.options import AuthorOptions
from spin_usd.errors import InputError
from spin_usd.options import flag_of, run_with
from spin_usd.terminal.lines import print_out, show_notes
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown

ROOT = "dataset.usda"


def author(
    context: typer.Context,
    options: AuthorOptions,
    *,
    minimal: Annotated[
        bool, typer.Option("--minimal", help="Write a complete stage of one page, to edit by hand.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Make a layered stage OUT/dataset.usda from a model, a camera, and a pose list or sampled poses."""
    from spin_usd.scene.derived.view_text import summary

    if minimal:
        _write_minimal(context, Path(options.out), as_json)
        return
    with shown(context.obj["quiet"]) as progress:
        report = run_with(spin_usd.author, options.telling(progress))
    if as_json:
        print_out(json.dumps(to_builtins(report)))
        return
    show_notes(report.notes)
    print_out(f"{report.root}   ({pluralise(report.frames, 'frame')})")
    print_out(*summary(report.views, [*report.sizes.values()]).split("\n"))


def _write_minimal(context: typer.Context, out: Path, as_json: bool) -> None:
    """Write the stage of one page into `out`. Raises InputError for any other option."""
    sources = {name: context.get_parameter_source(name) for name in context.params}
    asked = [name for name, source in sources.items() if source and source.name == "COMMANDLINE"]
    if given := [name for name in asked if name not in ("out", "minimal", "as_json")]:
        names = " and ".join(map(flag_of, given))
        are, them = ("is", "it") if len(given) == 1 else ("are", "them")
        raise InputError(f"{names} {are} given with --minimal, which needs only --out", do=f"drop {them}")
    root = write_minimal(out)
    print_out(json.dumps({"root": str(root)}) if as_json else f"{root}   (one page: edit it, then check and render it)")


def write_minimal(out: Path) -> Path:
    """Write the stage of one page into the new folder `out` and return its root layer. Raises InputError if `out`
    exists and is not empty, OutputError."""
    import shutil

    from spin_usd.basics.resources import stages
    from spin_usd.store.new_folder import new_folder

    with new_folder(out) as folder:
        shutil.copyfile(stages() / "examples" / "minimal.usda", folder / ROOT)
    return out / ROOT
