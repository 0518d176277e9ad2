"""What spin_usd costs, measured: `tools/bench NAME`, one of those below; `tools/bench NAME --help` has its sizes.

Each prints a table; with --json FILE its figures, and what they were measured on, also go into that file under its
name, beside those of the others (tools/figures/bench.json holds those of the documents).
"""

import argparse
import json
import os
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

from spin_usd.picture.versions import LIBRARIES
from spin_usd.processes.processors import machine

COMMANDS = ("frames", "equal_error", "labels", "stages", "device", "simulator", "events")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True, metavar="NAME")
    modules = {}
    for name in set(sys.argv[1:2]) & set(COMMANDS) or COMMANDS:  # one alone needs not what others do
        modules[name] = module = import_module(f"benchmarks.{name}")
        first = (module.__doc__ or "").partition("\n")[0]
        formatter = argparse.RawDescriptionHelpFormatter
        command = commands.add_parser(name, help=first, description=module.__doc__, formatter_class=formatter)
        module.add_options(command)
        command.add_argument("--quick", action="store_true", help="the smallest sizes: to try it, not to measure")
        command.add_argument("--json", type=Path, metavar="FILE", help="also put the figures into this file")
    options = parser.parse_args()
    module = modules[options.command]
    figures = module.measure(options)
    print(module.table(figures))
    if options.json:
        keep(options.json, options.command, figures)
    sys.stdout.flush()
    os._exit(0)  # the interpreter's teardown with bpy loaded can hang


def keep(file: Path, name: str, figures: dict[str, object]) -> None:
    """Put figures into the file under their name, with the machine; others in it stay."""
    kept = json.loads(file.read_text()) if file.is_file() else {}
    versions = {library: version(library) for library in LIBRARIES}
    kept[name] = {"machine": {**machine(), "versions": versions}, **figures}
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(dict(sorted(kept.items())), indent=1) + "\n")


if __name__ == "__main__":
    main()
