"""Craft from seeds, written as targets that `author` takes: one, or many that pictures show in turn."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.progress import Progress, no_progress
from spin_usd.commands.author.options import AuthorOptions, listed
from spin_usd.craft.make_craft import CraftChoice, make_craft
from spin_usd.craft.model import model_of
from spin_usd.errors import InputError
from spin_usd.sampling.sample import stream
from spin_usd.scene.asset import MeshAsset
from spin_usd.scene.shape import hull_points
from spin_usd.specifications.craft_spec import craft_choices, is_craft
from spin_usd.stage.author.craft_layer import write_crafts

SEED_WITH_POSES = re.compile(r"(craft:[0-9.]+|[^:]+\.toml)(:.+|)")
OF_ONE_MODEL = ("also", "prim", "model_time", "leave_out", "keypoints", "parts", "materials")
"""Options that change or accompany one model, of which craft in turn have many."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CraftTurns:
    """Craft that the pictures of a stage show in turn, each alone."""

    hulls: Mapping[str, Float]
    """Corners (N, 3) of each craft's convex hull, body axes, metres, by its name; all are shown."""
    shown: tuple[str, ...]
    """Name of the craft in each picture."""

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.hulls)

    @property
    def sizes(self) -> dict[str, float]:
        """Return the longest edge of each craft's bounding box, metres, by its name."""
        return {name: float(np.ptp(hull, axis=0).max()) for name, hull in self.hulls.items()}


def with_craft(
    options: AuthorOptions, folder: Path, sequences: Sequence[str], progress: Progress
) -> tuple[AuthorOptions, CraftTurns | None]:
    """Return the options with the craft of seeds and specifications as files, which are written into `folder`, and the
    turns of several; `sequences`: of each picture the name of its sequence, which shows one craft. Raises InputError,
    OutputError."""
    turns = None
    if options.target is not None and is_craft(given := str(options.target)):
        choices = craft_choices(given)
        unfit = [name for name in OF_ONE_MODEL if getattr(options, name)] if len(choices) > 1 else []
        if unfit:
            option = f"--{unfit[0].replace('_', '-')}"
            raise InputError(f"{given!r} is several craft in turn, and {option} is for one target", do="leave it out")
        places = _turns(len(choices), options.seed, sequences)
        used = sorted(set(places))
        models = {place: _made(choices[place], given, done, len(used), progress) for done, place in enumerate(used)}
        if len(choices) > 1:
            turns = CraftTurns(
                hulls={each.name: _hull(each) for each in models.values()},
                shown=tuple(models[place].name for place in places),
            )
        file = folder / f"{'crafts' if turns else _name(given, choices)}.usdc"
        write_crafts([*models.values()], file, f"Made by spin-usd author from {Path(given).name}.")
        options = replace(options, target=file)
    return replace(options, also=[_further(each, folder) for each in listed(options.also)]), turns


def _turns(count: int, seed: int, sequences: Sequence[str]) -> list[int]:
    """Return which of `count` craft each picture shows: all equally often, as far as that goes, in an order that is
    drawn from the seed."""
    units = list(dict.fromkeys(sequences))
    rng = stream(seed, "craft")
    drawn = np.concatenate([rng.permutation(count) for _ in range(-(-len(units) // count))])
    of_unit = dict(zip(units, drawn.tolist(), strict=False))
    return [of_unit[each] for each in sequences]


def _made(
    choice: CraftChoice, given: str, done: int = 0, count: int = 1, progress: Progress = no_progress
) -> MeshAsset:
    """Return the model of a craft. Raises InputError, with the given text or file, for one that cannot be made."""
    progress("making: craft", done, count)
    try:
        return model_of(make_craft(choice))
    except InputError as error:
        raise InputError(error.found, where=given, do=error.do) from None


def _hull(model: MeshAsset) -> Float:
    return hull_points(np.concatenate([part.points for part in model.parts]))


def _name(given: str, choices: Sequence[CraftChoice]) -> str:
    return f"craft_{choices[0].seed}" if given.startswith("craft:") else Path(given).stem


def _further(given: str, folder: Path) -> str:
    """Return a further body whose model, if it is a craft, is a file."""
    model, poses = found.groups() if (found := SEED_WITH_POSES.fullmatch(given)) else (given, "")
    if not is_craft(model):
        return given
    choices = craft_choices(model)
    if len(choices) > 1:
        do = "repeat --also for each, or show them in turn with --target"
        raise InputError(f"{model!r} is several craft, and a further body is one", do=do)
    file = folder / f"{_name(model, choices)}.usdc"
    write_crafts([_made(choices[0], model)], file, f"Made by spin-usd author from {Path(model).name}.")
    return f"{file}{poses}"
