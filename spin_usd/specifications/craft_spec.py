"""The craft that a user wants: a seed, or a TOML file that decides some of what the seed would draw."""

import re
from pathlib import Path
from typing import Annotated

from msgspec import UNSET, Meta, Struct, defstruct, structs

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

COUNTS = defstruct("Counts", [(key, Annotated[int, Meta(ge=0, le=20)], UNSET) for key in EQUIPMENT], frozen=True)
"""The keys of a craft.toml that count equipment."""


class CraftTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A craft.toml without its COUNTS; missing values are drawn from the seed."""

    seed: Annotated[int, Meta(ge=0, le=MAX_SEED)] = 0
    family: str | None = None
    size: Annotated[float, Meta(ge=0.1, le=30)] | None = None
    """Longest edge of the bus, or its diameter, metres."""
    finish: str | None = None
    """Material of the bus, one of the library."""
    wings: Annotated[int, Meta(ge=0, le=2)] | None = None
    panels: Annotated[int, Meta(ge=1, le=12)] | None = None
    driven: bool | None = None


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
    tables = dict(read_toml_file(file, MAX_SPECIFICATION))
    counts = structs.asdict(read_as(COUNTS, {key: tables.pop(key) for key in EQUIPMENT if key in tables}, file))
    table = read_as(CraftTable, tables, file)
    for key, value, known in (
        ("family", table.family, list(FAMILIES)),
        ("finish", table.finish, bundled_names("material")),
    ):
        if value is not None and value not in known:
            raise InputError(f"{key}: there is no {value!r}", where=file, do=f"choose one of {', '.join(known)}")
    given = {key: count for key, count in counts.items() if count is not UNSET}
    return CraftChoice(**structs.asdict(table), counts=given)
