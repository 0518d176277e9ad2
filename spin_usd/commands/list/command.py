"""`spin-usd list`: prints the names that other commands accept, each with a one-sentence description."""

import json
import re
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated

import typer

from spin_usd.basics.resources import BUNDLED, bundled, bundled_names
from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_TABLE
from spin_usd.files.user_file import read_text
from spin_usd.terminal.help_text import width
from spin_usd.terminal.lines import GOOD, Painted, print_out
from spin_usd.terminal.parameters import Json

HEAD = 4000  # characters at the start of a file that contain its description
DESCRIPTION = (
    re.compile(r'^\s*doc = ("""|")(.*?)\1', re.MULTILINE | re.DOTALL),  # of a layer
    re.compile(r'^title = (")(.*?)"', re.MULTILINE),  # of a sampling specification
    re.compile(r"(^# )(.*?)(?=^[^#])", re.MULTILINE | re.DOTALL),  # of other TOML files: their first comment
)
SENTENCE = re.compile(r".*?\.(?= [A-Z]|$)|.*")


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Names of one kind."""

    option: str
    """Options that take them."""
    names: Callable[[], Mapping[str, str]]
    """Description of each, one sentence."""


def _travelling(kind: str) -> Callable[[], Mapping[str, str]]:
    """Return a function for the names of the bundled files of that kind, one of BUNDLED."""
    return lambda: {name: _said(kind, name) for name in bundled_names(kind)}


def _said(kind: str, name: str) -> str:
    """Return the first sentence of the file's description."""
    head = read_text(bundled(kind, name), MAX_TABLE)[:HEAD]
    found = next(filter(None, (pattern.search(head) for pattern in DESCRIPTION)))
    words = " ".join(found[2].replace("\n# ", " ").split())
    return (SENTENCE.match(words) or found)[0]


def _labels() -> Mapping[str, str]:
    from spin_usd.labels.table import LABELS  # not above: it loads numpy

    return {name: label.channels.meaning for name, label in LABELS.items()}


def _event_sensors() -> Mapping[str, str]:
    from spin_usd.scene.event_sensor import PRESETS  # not above: it loads numpy

    said = (
        "thresholds {0.threshold_on:.2g} and {0.threshold_off:.2g}, cutoff {0.cutoff:g} Hz, noise {0.shot_noise:g} Hz"
    )
    return {name: said.format(each) for name, each in PRESETS.items()}


def _formats() -> Mapping[str, str]:
    from spin_usd.exchange.table import EXPORT_FORMATS  # not above: it loads numpy

    return {name: each.holds for name, each in EXPORT_FORMATS.items()}


LISTS = {
    "targets": Kind(option="author --target, --also", names=_travelling("target")),
    "cameras": Kind(option="author --camera", names=_travelling("camera")),
    "presets": Kind(option="author --preset", names=_travelling("preset")),
    "lights": Kind(option="author --lights", names=_travelling("lights")),
    "environments": Kind(option="author --environment", names=_travelling("environment")),
    "lidars": Kind(option="author --lidar", names=_travelling("lidar")),
    "materials": Kind(option="author --materials", names=_travelling("material")),
    "samples": Kind(option="author --sample", names=_travelling("sample")),
    "scenarios": Kind(option="author --scenario", names=_travelling("scenario")),
    "augmentations": Kind(option="augment --spec, author --augment", names=_travelling("specification")),
    "event-sensors": Kind(option="author --event-sensor", names=_event_sensors),
    "labels": Kind(option="render --labels", names=_labels),
    "formats": Kind(option="export --to", names=_formats),
}
assert len(LISTS) == len(BUNDLED) + 3, "each kind of bundled files is listed"


def list(
    kind: Annotated[str | None, typer.Argument(metavar="[KIND]", help=f"{', '.join(LISTS)}; all if not given.")] = None,
    *,
    as_json: Json = False,
) -> None:
    """List the names that other commands accept: targets, cameras, presets, lights, labels and more."""
    if kind is not None and kind not in LISTS:
        raise InputError(f"there are no {kind!r} to list", do=suggestion(kind, LISTS))
    chosen = LISTS if kind is None else {kind: LISTS[kind]}
    if as_json:
        print_out(json.dumps({title: each.names() for title, each in chosen.items()}))
        return
    for title, each in chosen.items():
        print_out((Painted(title, GOOD, bold=True), f"   ({each.option})"))
        names = each.names()
        longest = max(map(len, names))
        for name, said in names.items():
            first, *more = textwrap.wrap(said, max(width() - longest - 4, 30))
            print_out(f"  {name:{longest}}  {first}", *(" " * (longest + 4) + line for line in more))
