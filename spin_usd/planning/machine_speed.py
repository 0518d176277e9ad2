"""The speed of this machine relative to the one of `cost`: the time of a trial, kept for the next plan.

It is stored in the user's cache folder, $XDG_CACHE_HOME or ~/.cache, in a file for each kind of processor and set of
libraries, as several machines may share a home. If it is missing or damaged, the trial is made again.
"""

import os
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct, to_builtins

from spin_usd.basics.nesting import typed_json
from spin_usd.errors import SpinError
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.picture.versions import library_versions
from spin_usd.processes.processors import processor_model
from spin_usd.store.atomic import write_json

TRIAL_S = 0.021  # the trial of planning.speed_trial, on the machine that the constants were measured on
LIKELY = 100  # times as fast or as slow; anything else is damage
FOLDER = "spin_usd"


class Trial(Struct, frozen=True, kw_only=True):
    """A trial of this machine, as stored in the user's cache folder."""

    trial_s: Annotated[float, Meta(gt=TRIAL_S / LIKELY, lt=TRIAL_S * LIKELY)]
    made_by: dict[str, str]
    """Facts that must be the same for the trial to hold."""


def kept_trial() -> float | None:
    """Return the seconds of the trial that an earlier plan made on such a machine; None if there is none."""
    folder = _folder()
    if folder is not None:
        with suppress(SpinError, ValueError):
            return typed_json(folder.read(_file_name(), MAX_SPECIFICATION), Trial).trial_s
    return None


def keep_trial(seconds: float) -> None:
    """Keep the seconds of a trial for the next plan; do nothing where the folder cannot be written."""
    folder = _folder()
    if folder is not None:
        with suppress(SpinError, OSError):
            trial = Trial(trial_s=seconds, made_by=_made_by())
            write_json(folder, _file_name(), to_builtins(trial), work=folder.root)


def slower_by(trial_s: float | None) -> float:
    """Return how many times slower the machine is if the trial took so long; 1 if unknown."""
    return 1.0 if trial_s is None else trial_s / TRIAL_S


def _folder() -> Folder | None:
    """Return our folder in the user's cache folder; None for a user without a home."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    with suppress(RuntimeError):
        return Folder((given if given.is_absolute() else Path.home() / ".cache") / FOLDER)
    return None


def _file_name() -> str:
    return f"speed-{sha256(repr(_made_by()).encode()).hexdigest()[:16]}.json"


def _made_by() -> dict[str, str]:
    """Return the facts that decide the trial's time: the processor, and the libraries."""
    return {"processor": processor_model(), **library_versions()}
