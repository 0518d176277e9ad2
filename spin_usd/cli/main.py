"""The command line. Heavy things are imported inside the commands: `--help` loads neither bpy nor pxr."""

import json
import signal
import sys
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

import spin_usd
from spin_usd.cli.augment import augment
from spin_usd.cli.author import author
from spin_usd.cli.command import Command, Group
from spin_usd.cli.counted import counted
from spin_usd.cli.diff import diff
from spin_usd.cli.examples import examples_of
from spin_usd.cli.measure import measure
from spin_usd.cli.options import Json, NoCache, Prune, Replace, Verify, Workers
from spin_usd.cli.plan import plan
from spin_usd.cli.progress import shown
from spin_usd.cli.request import show_doubts, with_request
from spin_usd.errors import DONE, FINDINGS, INTERNAL, SpinError

INTERRUPTED = 130

app = typer.Typer(
    cls=Group,
    name="spin-usd",
    help="Labelled, traceable, reproducible imagery of a spacecraft from layered USD stages.",
    epilog="Exit codes: 0 done, 1 findings or failed pictures, 2 wrong usage or bad input, 3 internal error, "
    "130 interrupted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(asked: bool) -> None:
    if asked:
        print(f"spin-usd {spin_usd.__version__}")
        raise typer.Exit


@app.callback()
def common(
    context: typer.Context,
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks; may stand anywhere.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Show no progress; may stand anywhere.")] = False,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    context.obj = {"quiet": quiet}


@app.command(cls=Command)
def demo(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder to make.")] = Path("demo"),
    workers: Workers = None,
) -> None:
    """Author the example stage, render and label it, and say where to look."""
    from spin_usd.dataset.demo import run_demo

    with shown(context.obj["quiet"]) as progress:
        made = run_demo(out, progress=progress, workers=workers)
    print(f"stage          {made.stage}   (open it in usdview, Blender or an editor)")
    print(f"dataset        {made.dataset}   ({made.report.pictures} pictures in {made.report.seconds:.0f} s)")
    print(f"contact sheet  {made.contact_sheet}   (image, depth, parts, dense pose)")
    _warn_of_faults(made.report, made.dataset)
    _exit_if_failed(made.report.failed)


app.command(cls=Command, epilog=examples_of("author"))(author)


app.command(cls=Command, epilog=examples_of("augment"))(augment)


app.command(cls=Command, epilog=examples_of("plan"))(plan)


app.command(cls=Command, epilog=examples_of("measure"))(measure)


@app.command(cls=Command, epilog=examples_of("render"))
@with_request
def render(
    context: typer.Context,
    *,
    out: Annotated[Path, typer.Option(help="The dataset's folder. Run again, it resumes.")],
    request: Any,
    workers: Workers = None,
    no_cache: NoCache = False,
    prune: Prune = False,
    replace: Replace = False,
    verify: Verify = False,
    as_json: Json = False,
) -> None:
    """Render and label a stage into a dataset."""
    from spin_usd.dataset.render import render as rendering

    with shown(context.obj["quiet"]) as progress:
        report = rendering.render(
            request,
            out,
            workers=workers,
            keep_cache=not no_cache,
            prune=prune,
            replace=replace,
            verify=verify,
            progress=progress,
        )
    show_doubts(report.doubts)
    if as_json:
        print(json.dumps(asdict(report)))
    else:
        removed = f", {report.pruned} removed" if prune or report.pruned else ""
        made = (
            f"{counted(report.made, 'picture')} made, {report.reused} already there{removed}, in {report.seconds:.1f} s"
        )
        passes = f"{report.label_passes} label passes made, {report.labels_shared} shared"
        print(f"{out}   ({made}; {passes}; {report.renders} renders made, {report.renders_shared} shared)")
        _warn_of_faults(report, out)
    _exit_if_failed(report.failed)


@app.command(cls=Command, epilog=examples_of("check"))
def check(
    context: typer.Context,
    path: Annotated[Path, typer.Argument(help="A stage or a dataset.")],
    as_json: Json = False,
) -> None:
    """Look for what is wrong with a stage or a dataset: conventions, schemas, digests, label consistency."""
    from spin_usd.dataset.check.check import check as find
    from spin_usd.scene.derived.view_text import summary

    with shown(context.obj["quiet"]) as progress:
        checked = find(path, progress=progress)
    kind, findings, views = checked.kind, checked.findings, checked.views
    errors = [finding for finding in findings if finding.severity == "error"]
    if as_json:
        shows = {"views": views.as_json()} if views else {}
        print(json.dumps({"kind": kind, "findings": [asdict(finding) for finding in findings], **shows}))
    else:
        if views:
            print(summary(views))
        for finding in findings:
            print(f"{finding.severity}: {finding.where}: {finding.message} [{finding.code}]")
        warnings = counted(len(findings) - len(errors), "warning")
        print(f"{kind} {path}: {counted(len(errors), 'error')}, {warnings}")
    if errors:
        raise typer.Exit(FINDINGS)


app.command(cls=Command, epilog=examples_of("diff"))(diff)


@app.command(cls=Command, epilog=examples_of("reproduce"))
def reproduce(
    dataset: Annotated[Path, typer.Argument(help="A dataset's folder.")],
    frame: Annotated[str, typer.Argument(help="A picture's name, such as img000001.")],
    variant: Annotated[str, typer.Option(metavar="NAME")] = "nominal",
    as_json: Json = False,
) -> None:
    """Make one picture again from its provenance and compare it with the one there."""
    from spin_usd.dataset.reproduce.reproduce import reproduce as again

    compared, versions = again(dataset, frame, variant=variant)
    if as_json:
        print(json.dumps({"files": [{**asdict(c), "same": c.same} for c in compared], "versions": versions}))
    else:
        for c in compared:
            print(f"{'same     ' if c.same else 'DIFFERENT'}  {c.path}")
        for name, (recorded, now) in versions.items():
            print(f"note: {name} was {recorded or 'absent'}, is {now or 'absent'}", file=sys.stderr)
    if not all(c.same for c in compared):
        raise typer.Exit(FINDINGS)


@app.command(cls=Command)
def doctor(
    folder: Annotated[Path, typer.Option(help="Where datasets would go.")] = Path(),
    as_json: Json = False,
) -> None:
    """What this machine has and lacks, each line with its remedy."""
    from spin_usd.dataset.doctor import examine

    lines = []
    for line in examine(folder):
        lines.append(line)
        if not as_json:
            print(f"{'ok ' if line.well else 'NO '} {line.subject:26} {line.found}", flush=True)
            if line.remedy:
                print(f"    {'':26} -> {line.remedy}")
    if as_json:
        print(json.dumps([asdict(line) for line in lines]))
    if not all(line.well for line in lines):
        raise typer.Exit(FINDINGS)


def _warn_of_faults(report: Any, dataset: Path) -> None:
    """Say on standard error how many pictures show little, where any does."""
    from spin_usd.dataset.picture.brightness import counted_faults

    if text := counted_faults(report.faults, report.made + report.reused):
        print(f"warning: {text}; spin-usd check {dataset} names them", file=sys.stderr)


def _exit_if_failed(failed: list[tuple[str, str]]) -> None:
    for name, reason in failed:
        print(f"failed: {name}: {reason}", file=sys.stderr)
    if failed:
        raise typer.Exit(FINDINGS)


def run() -> NoReturn:
    """The console script: every failure is one sentence and a documented exit code."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    arguments = [a for a in sys.argv[1:] if a not in ("--debug", "--quiet")]
    debug, quiet = ("--debug" in sys.argv[1:]), (["--quiet"] if "--quiet" in sys.argv[1:] else [])
    code: Any
    try:
        app(args=quiet + arguments, prog_name="spin-usd")
        code = DONE
    except SystemExit as e:
        code = e.code
        if code == INTERRUPTED:
            print("interrupted; a render or a measurement run again takes up where it stopped", file=sys.stderr)
    except SpinError as e:
        code = _report(e, str(e), e.exit_code, debug)
    except Exception as e:
        what = f"internal error: {type(e).__name__}: {e}".splitlines()[0]
        code = _report(e, f"{what}; run again with --debug and report it", INTERNAL, debug)
    sys.exit(code)


def _report(error: BaseException, sentence: str, code: int, debug: bool) -> int:
    print(f"spin-usd: {sentence}", file=sys.stderr)
    if debug:
        traceback.print_exception(error)
    return code


if __name__ == "__main__":
    run()
