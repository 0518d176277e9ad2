"""The command line.

Heavy things are imported inside the commands: `--help` loads neither bpy nor pxr.
"""

import sys
import traceback
from typing import Annotated, Any, NoReturn

import typer

import spin_usd
from spin_usd.basics.faults import expected
from spin_usd.basics.stop_signals import Stopped, let_signals_stop
from spin_usd.commands.augment.command import augment
from spin_usd.commands.author.command import author
from spin_usd.commands.check.command import check
from spin_usd.commands.debug.command import debug as debug_command
from spin_usd.commands.demo.command import demo
from spin_usd.commands.diff.command import diff
from spin_usd.commands.doctor.command import doctor
from spin_usd.commands.evidence.command import evidence
from spin_usd.commands.export.command import export
from spin_usd.commands.gap.command import gap
from spin_usd.commands.keypoints.command import keypoints
from spin_usd.commands.list.command import list as list_names
from spin_usd.commands.measure.command import measure
from spin_usd.commands.merge.command import merge
from spin_usd.commands.plan.command import plan
from spin_usd.commands.render.command import render
from spin_usd.commands.reproduce.command import reproduce
from spin_usd.commands.score.command import score
from spin_usd.commands.serve.command import serve
from spin_usd.commands.show.command import show as show_dataset
from spin_usd.commands.watch.command import watch
from spin_usd.errors import BAD_INPUT, DONE, FINDINGS, INTERNAL
from spin_usd.terminal.command import Command, Group
from spin_usd.terminal.help_text import examples_of, width
from spin_usd.terminal.lines import BAD, LastingStream, Painted, lasting_streams, print_err, print_out, show_warnings
from spin_usd.terminal.parameters import with_options

STOPPED = 128  # and the signal's number, as shells have it

app = typer.Typer(
    cls=Group,
    name="spin-usd",
    help="Labelled, traceable, reproducible imagery of a spacecraft from layered USD stages.",
    epilog="Exit codes: 0 done, 1 findings or failed pictures, 2 wrong usage or bad input, 3 internal error, "
    "129, 130 and 143 stopped by a closed terminal, Ctrl-C and SIGTERM.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "terminal_width": width()},
)


def _print_version(asked: bool) -> None:
    if asked:
        print_out(f"spin-usd {spin_usd.__version__}")
        raise typer.Exit


@app.callback()
def common(
    context: typer.Context,
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks; allowed anywhere on the line.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Show no progress; allowed anywhere on the line.")] = False,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    from spin_usd.processes.child_limits import refuse_tight_limits

    refuse_tight_limits()
    show_warnings()
    context.obj = {"quiet": quiet}


RESUMED = {"demo", "render", "merge", "export", "measure", "show"}
"""Commands that resume an earlier run that was stopped."""

COMMANDS = (
    *(demo, list_names, author, keypoints, augment, plan, measure, render, merge),
    *(check, show_dataset, export, score, gap, evidence, diff, reproduce, watch, serve, debug_command, doctor),
)
for command in COMMANDS:
    summary = (command.__doc__ or "").partition("\n")[0]
    app.command(cls=Command, short_help=summary, epilog=examples_of(command.__name__))(with_options(command))


def run() -> NoReturn:
    """Run the console script: every failure is one sentence and a documented exit code."""
    output = lasting_streams()
    let_signals_stop()
    arguments = [a for a in sys.argv[1:] if a not in ("--debug", "--quiet")]
    debug, quiet = ("--debug" in sys.argv[1:]), (["--quiet"] if "--quiet" in sys.argv[1:] else [])
    code: Any
    try:
        app(args=quiet + arguments, prog_name="spin-usd")
        code = DONE
    except SystemExit as e:
        code = e.code
    except Stopped as e:
        resumes = "; run the same command again to resume" if RESUMED & set(arguments) else ""
        code = _report(e, f"{e}{resumes}", STOPPED + e.number, debug)
    except Exception as e:
        if error := expected(e):
            code = _report(e, str(error), error.exit_code, debug)
        else:
            what = f"internal error: {type(e).__name__}: {e}".splitlines()[0]
            code = _report(e, f"{what}; run again with --debug and report it", INTERNAL, debug)
    sys.exit(_arrived(output, code))


def _arrived(output: LastingStream, code: Any) -> Any:
    """Return the exit code, also for a command that succeeded but whose output could not be written."""
    sys.stdout.flush()
    if output.fault is None or code not in (DONE, FINDINGS):
        return code
    print_err(f"spin-usd: standard output cannot be written ({output.fault.strerror}); the rest was done")
    return BAD_INPUT


def _report(error: BaseException, sentence: str, code: int, debug: bool) -> int:
    print_err((Painted("spin-usd:", BAD, bold=True), f" {sentence}"))
    if debug:
        traceback.print_exception(error)
    return code


if __name__ == "__main__":
    run()
