"""The craft that a user wants: a seed, or a TOML file that decides some of what the seed would draw."""

import re
from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct, defstruct, structs

from spin_usd.basics.resources import bundled_names
from spin_usd.craft.buses import FAMILIES
from spin_usd.craft.equipment import EQUIPMENT
from spin_usd.craft.make_craft import CraftChoice
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.checked_document import read_as
from spin_usd.formats.text_file import read_toml_file

SEEDS = re.compile(r"craft:(\d+)(?:\.\.(\d+))?")
MAX_SEED = 2**63 - 1
MAX_CRAFT = 1000  # of one stage


class CraftKeys(Struct, frozen=True, kw_only=True):
    """A craft.toml without its numbers of equipment; missing values are drawn from the seed."""

    seed: Annotated[int, Meta(ge=0, le=MAX_SEED)] = 0
    family: str | None = None
    size: Annotated[float, Meta(ge=0.1, le=30)] | None = None
    """Longest edge of the bus, or its diameter, metres."""
    finish: str | None = None
    """Material of the bus, one of the library."""
    wings: Annotated[int, Meta(ge=0, le=2)] | None = None
    panels: Annotated[int, Meta(ge=1, le=12)] | None = None
    driven: bool | None = None


CRAFT_TABLE = defstruct(
    "CraftTable",
    [(key, Annotated[int, Meta(ge=0, le=20)] | None, None) for key in EQUIPMENT],
    bases=(CraftKeys,),
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
)
"""A craft.toml."""


def is_craft(given: str) -> bool:
    """Return whether a target is a craft to make: craft:SEED, craft:FIRST..LAST or a TOML file."""
    return given.startswith("craft:") or Path(given).suffix.lower() == ".toml"


def craft_choices(given: str) -> tuple[CraftChoice, ...]:
    """Return the wanted craft. Raises InputError for other texts, and for a file that is no craft.toml."""
    if not given.startswith("craft:"):
        return (_of_file(Path(given)),)
    if not (found := SEEDS.fullmatch(given)):
        raise InputError(f"{given!r} has no seed", do="write craft:SEED, such as craft:7, or craft:FIRST..LAST")
    first, last = int(found[1]), int(found[2] or found[1])
    if not first <= last <= MAX_SEED or last - first >= MAX_CRAFT:
        do = f"give seeds from the lower to the higher, below 2^63, and {MAX_CRAFT} craft at most"
        raise InputError(f"{given!r} is no range of seeds", do=do)
    return tuple(CraftChoice(seed=seed) for seed in range(first, last + 1))


def _of_file(file: Path) -> CraftChoice:
    values = structs.asdict(read_as(CRAFT_TABLE, read_toml_file(file, MAX_SPECIFICATION), file))
    for key, known in (("family", list(FAMILIES)), ("finish", bundled_names("material"))):
        if (value := values[key]) is not None and value not in known:
            raise InputError(f"{key}: there is no {value!r}", where=file, do=f"choose one of {', '.join(known)}")
    counts = {key: count for key in EQUIPMENT if (count := values.pop(key)) is not None}
    choice = CraftChoice(**values, counts=counts)
    if choice.wings == 0 and choice.needs_wings:
        other = "panels" if choice.panels else "driven"
        raise InputError(f"wings: 0 contradicts {other}", where=file, do="leave one of them out")
    return choice
