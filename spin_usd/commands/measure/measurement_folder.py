"""The folder of a measurement: whether and of which subject one may be written there, and its files."""

import json
import os
from collections.abc import Mapping
from pathlib import Path

from msgspec import to_builtins

from spin_usd.accuracy.measurement import Measurement
from spin_usd.accuracy.report import in_full
from spin_usd.commands.measure.plot import plot
from spin_usd.commands.measure.renders import SUBJECT, RenderStore, is_render_file, render_file
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.store.atomic import fill_atomically, write_text
from spin_usd.store.dataset_folder import Store, refuse_special_files
from spin_usd.store.measurement_file import FILE, read_measurement

RUNS = "runs"
TABLES, PLOT = "measure.md", "measure.svg"
OURS = (FILE, TABLES, PLOT, RUNS)


def prepare(folder: Path) -> None:
    """Check that a measurement may be written here; write nothing. Raises InputError if the folder contains anything
    else, or not a measurement, OutputError if it is not a folder."""
    held = Store(root=folder).contents()
    refuse_special_files(Folder(folder), OURS)
    own = held and Folder(folder).type_of(f"{RUNS}/{render_file(SUBJECT)}") is NodeType.FILE
    runs = (name for name in Folder(folder).files(RUNS) if not is_render_file(name.removeprefix(f"{RUNS}/")))
    strays = [*(name for name in held if not own or name not in OURS), *runs]
    if strays:
        raise InputError(f"contains {strays[0]}, not part of a measurement", where=folder, do="choose an empty folder")


def subject_of(stage: Path, variant: str, folder: Path) -> dict[str, str]:
    """Return the name of the subject: it stays the same when the stage is edited, or moved with the folder."""
    root = os.path.relpath(stage.resolve(), folder.resolve())
    return {"stage": Path(root).as_posix(), "variant": variant}


def refuse_another(runs: RenderStore, subject: Mapping[str, str], folder: Path) -> None:
    """Raise InputError if the folder contains a measurement of another subject."""
    held = runs.known(SUBJECT) or subject
    if held != subject:
        found = f"contains a measurement of variant {held['variant']} of {held['stage']}"
        raise InputError(found, where=folder, do="give another folder with --out")


def write_measurement(folder: Folder, measurement: Measurement, work: Path) -> None:
    """Write the measurement as JSON, checked before it is in place."""

    def write(temporary: Path) -> None:
        text = json.dumps(to_builtins(measurement), indent=1, allow_nan=False) + "\n"
        temporary.write_text(text, encoding="utf-8")
        read_measurement(temporary)

    fill_atomically(folder, FILE, write, work=work)


def write_report(folder: Path, measurement: Measurement, *, work: Path) -> None:
    """Write both files into `folder`, over existing ones. Raises OutputError."""
    shown = f"{in_full(measurement)}\n![Error against CPU seconds]({PLOT})\n"
    for name, text in ((TABLES, shown), (PLOT, plot(measurement))):
        write_text(Folder(folder), name, text, work=work)
