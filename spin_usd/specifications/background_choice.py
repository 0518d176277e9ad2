"""The choice among backgrounds that a specification states."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_TEXTURE
from spin_usd.files.user_file import open_file
from spin_usd.sampling.distribution import Choice, Fixed
from spin_usd.sampling.sample import distribution_of
from spin_usd.scene.environment import BACKGROUND
from spin_usd.specifications.sample_table import SampleEntry
from spin_usd.stage.augment.background import beside
from spin_usd.stage.author.lights_and_environment import PICTURES


def background_choice(sample: SampleEntry, folder: Path) -> Choice | Fixed:
    """Return the distribution of names of environments and of pictures beside the specification in `folder`. Raises
    InputError unless it is a choice of names."""
    distribution = distribution_of(_listed(sample.words, folder))
    if sample.unit or not isinstance(distribution, Choice | Fixed):
        do = 'give it distribution = "choice", "in_turn" or "fixed", without unit'
        raise InputError("is not one choice among names", where=BACKGROUND, do=do)
    return distribution


def _listed(words: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """Return the words of a choice, with the pictures of its `folder` as its values. Raises
    InputError."""
    if "folder" not in words:
        return words
    if "values" in words:
        raise InputError("has both folder and values", where=BACKGROUND, do="keep one of them")
    pictures = images_in(beside(folder, words["folder"]), "picture")
    rest = {key: value for key, value in words.items() if key != "folder"}
    return {**rest, "values": [str(each.relative_to(folder)) for each in pictures]}


def images_in(path: Path, what: str) -> list[Path]:
    """Return the images in the folder `path`, in order, or the image `path`. Raises InputError, which calls them
    `what`, for a folder without any, and for a file that is not an image or cannot be opened."""
    files = [path]
    if path.is_dir():
        listed = (file for file in path.iterdir() if not file.name.startswith("."))  # not macOS' ._a.jpg
        files = sorted(file for file in listed if file.suffix.lower() in PICTURES)
        if not files:
            raise InputError(f"contains no {what}", where=path, do=f"put {', '.join(PICTURES)} files there")
    elif path.exists() and path.suffix.lower() not in PICTURES:
        do = f"give a folder, or one of {', '.join(PICTURES)}"
        raise InputError(f"is not a supported {what}", where=path, do=do)
    for file in files:
        open_file(file, MAX_TEXTURE).close()  # so that no library opens a pipe or a huge file
    return files
