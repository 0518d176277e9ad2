"""What a shell completes besides commands and options: names that travel with spin_usd, and those in a dataset.

A shell runs spin-usd each time that Tab is pressed, so nothing heavy is loaded before it is asked for, and what goes
wrong completes nothing. It takes what is printed for words: of what a dataset holds, only names that are one plain word
are offered.
"""

import re
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, TypedDict

from spin_usd.basics.resources import bundled_names
from spin_usd.errors import InputError, SpinError
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_DOCUMENT

PLAIN = re.compile(r"[\w.-]+", re.ASCII)


def listed_in(module: str, name: str, *more: str) -> Callable[[str], Collection[str]]:
    """Return a completion to `more`, and the names in a collection of a module, which only a completion loads."""

    def complete(incomplete: str) -> Collection[str]:
        return (*more, *getattr(import_module(module), name))

    return complete


def bundled(kind: str) -> Callable[[str], Collection[str]]:
    """Return a completion to the names of what travels with spin_usd: `kind` is one of resources.BUNDLED."""

    def complete(incomplete: str) -> Collection[str]:
        with suppress(SpinError):
            return bundled_names(kind)
        return ()

    return complete


def named(kind: str) -> str:
    """List the bundled names of `kind`, one of resources.BUNDLED, for a help text, such as "sun, sunlamp".

    In a broken installation, which doctor reports, it says only that there are names.
    """
    try:
        return ", ".join(bundled_names(kind))
    except InputError:
        return "a name"


def frames_of_dataset(ctx: Any, incomplete: str) -> list[str]:
    """Return the frames of the dataset on the command line, as far as it has records of them as `nominal`."""
    with suppress(SpinError):
        records = _dataset(ctx).files("records/nominal")
        return _plain(name.rpartition("/")[2].removesuffix(".json") for name in records)
    return []


class _Described(TypedDict):
    variants: list[str]


def variants_of_dataset(ctx: Any, incomplete: str) -> list[str]:
    """Return the variants of the dataset on the command line."""
    from spin_usd.basics.nesting import typed_json  # not above: it loads numpy

    with suppress(SpinError, ValueError):
        return _plain(typed_json(_dataset(ctx).read("dataset.json", MAX_DOCUMENT), _Described)["variants"])
    return []


def _dataset(ctx: Any) -> Folder:
    """Return the folder in the first argument, which typer leaves unread where an option still lacks its value."""
    return Folder(Path(ctx.params.get("dataset") or next(iter(ctx.args), "")))


def _plain(names: Iterable[str]) -> list[str]:
    return [name for name in names if PLAIN.fullmatch(name)]
