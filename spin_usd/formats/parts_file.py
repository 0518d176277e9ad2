"""Names and classes for the parts of a model, by patterns: JSON, CSV or TOML."""

from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.formats.table_file import Row, Table, read_table
from spin_usd.scene.part_rule import PartRule

TABLE = Table(key="pattern", required=("part",), optional=("class",))


def read_parts_file(path: str | Path) -> tuple[PartRule, ...]:
    """Read the rules of the file at `path`, in its order; those of one part have one class. Raises InputError that
    names the file and the row."""
    rows = read_table(path, TABLE)
    classes: dict[str, str] = {}
    for row in rows:
        part, given = _label(row, "part"), _label(row, "class") if "class" in row.values else None
        if given is not None and classes.setdefault(part, given) != given:
            found = f"gives the part {part!r} the class {given!r}, and another row gives it {classes[part]!r}"
            raise InputError(found, where=row.where, do="give one part one class")
    names = [(row.name, _label(row, "part")) for row in rows]
    return tuple(PartRule(pattern=pattern, part=part, class_name=classes.get(part)) for pattern, part in names)


def _label(row: Row, column: str) -> str:
    given = row.values[column]
    if not isinstance(given, str) or not given.isprintable() or len(given) > 255:
        raise InputError(
            f"has the {column} {given!r}", where=row.where, do="give printable text of up to 255 characters"
        )
    return given
