"""The choice among backgrounds that a specification states."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from spin_usd.commands.author.sources import images_in
from spin_usd.errors import InputError
from spin_usd.formats.sample_table import SampleEntry
from spin_usd.sampling.distribution import Choice, Fixed
from spin_usd.sampling.sample import distribution_of
from spin_usd.scene.environment import BACKGROUND
from spin_usd.stage.augment.background import beside


def background_choice(sample: SampleEntry, folder: Path) -> Choice | Fixed:
    """Return the distribution of names of environments and of pictures beside the specification in `folder`. Raises
    InputError unless it is a choice of names."""
    distribution = distribution_of(_listed(sample.words, folder))
    if sample.unit or not isinstance(distribution, Choice | Fixed):
        do = 'give it distribution = "choice", "in_turn" or "fixed", without unit'
        raise InputError("is not one choice among names", where=BACKGROUND, do=do)
    return distribution


def _listed(words: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """Return the words of a choice with the pictures of the `folder` that it names for its values. Raises
    InputError."""
    if "folder" not in words:
        return words
    if "values" in words:
        raise InputError("has both folder and values", where=BACKGROUND, do="keep one of them")
    pictures = images_in(beside(folder, words["folder"]), "picture")
    rest = {key: value for key, value in words.items() if key != "folder"}
    return {**rest, "values": [str(each.relative_to(folder)) for each in pictures]}
