"""Craft from seeds, written as targets that `author` takes."""

import re
from dataclasses import replace
from pathlib import Path

from spin_usd.commands.author.options import AuthorOptions, listed
from spin_usd.craft.make_craft import make_craft
from spin_usd.craft.model import model_of
from spin_usd.specifications.craft_spec import craft_choices, is_craft
from spin_usd.stage.author.craft_layer import write_crafts

SEED_WITH_POSES = re.compile(r"(craft:\d+|[^:]+\.toml)(:.+|)")


def with_craft(options: AuthorOptions, folder: Path) -> AuthorOptions:
    """Return the options with the craft of seeds and specifications as files, which are written into `folder`. Raises
    InputError, OutputError."""
    if options.target is not None and is_craft(str(options.target)):
        options = replace(options, target=_written(str(options.target), folder))
    return replace(options, also=[_further(each, folder) for each in listed(options.also)])


def _further(given: str, folder: Path) -> str:
    """Return a further body whose model, if it is a craft, is a file."""
    model, poses = found.groups() if (found := SEED_WITH_POSES.fullmatch(given)) else (given, "")
    return f"{_written(model, folder)}{poses}" if is_craft(model) else given


def _written(given: str, folder: Path) -> Path:
    """Write the craft that are `given`; return their layer."""
    choices = craft_choices(given)
    crafts = [model_of(make_craft(each)) for each in choices]
    name = crafts[0].name if given.startswith("craft:") else Path(given).stem
    file = folder / f"{name}.usdc"
    write_crafts(crafts, file, f"Made by spin-usd author from {given if file.stem == name else Path(given).name}.")
    return file
