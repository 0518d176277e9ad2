"""The folder of a report: a page, and the same as JSON."""

from collections.abc import Iterable
from pathlib import Path

import msgspec

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.store.atomic import write_text

PAGE = "index.html"


def refuse_other_files(out: Path, report: str, names: Iterable[str]) -> None:
    """Raise InputError for a folder that holds a file of one of our `names`, but no `report` of ours."""
    taken = next((name for name in (PAGE, *names) if (out / name).exists()), None)
    if taken and not (out / report).is_file():
        raise InputError(f"holds {taken}, but no {report} of ours", where=out, do="give another folder")


def write_report(out: Path, name: str, report: object, page: str, *, work: Path) -> None:
    """Write the report as JSON under that name, and its page, into the folder `out`. Raises OutputError."""
    text = msgspec.json.format(msgspec.json.encode(report), indent=1).decode() + "\n"
    for file, content in ((PAGE, page), (name, text)):
        write_text(Folder(out), file, content, work=work)
