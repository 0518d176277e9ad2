"""Files that a model names, as exporters of any system write their paths."""

import re
from pathlib import Path
from urllib.parse import unquote

from spin_usd.files.user_file import names_in

ABSOLUTE = re.compile(r"[A-Za-z]:[\\/]|[\\/]")


def file_within(folder: Path, beside: Path, named: str) -> Path | None:
    """Return the path of the file that a file in the folder `beside` calls `named`: "x.mtl", "./x.mtl", or with
    backslashes. Of an absolute path, which was the writer's own, the end counts for which there is a file.

    None if the path is outside `folder`, links followed, or invalid; the file need not exist. If there is none, but one
    whose name differs only in case, as on Windows, its path is returned.
    """
    path = Path(named.replace("\\", "/"))
    if ABSOLUTE.match(named):
        ends = ("/".join(path.parts[n:]) for n in range(1, len(path.parts)))
        there = (file_within(folder, beside, end) for end in ends)
        return next((file for file in there if file is not None and file.is_file()), None)
    try:
        full = (beside / path).resolve()
    except ValueError:  # NUL, or a character outside the file system's encoding
        return None
    if ":" in named or not full.is_relative_to(folder.resolve()):
        return None
    if full.exists():
        return full
    found = folder.resolve()
    for part in full.relative_to(found).parts:
        found /= next((name for name in names_in(found) if name.lower() == part.lower()), part)
    return found if found.resolve().is_relative_to(folder.resolve()) else None


def name_of(url: str, folder: Path, beside: Path) -> str:
    """Return the file's name that a relative URL means: as it stands where there is a file of that name, as exporters
    that encode nothing write it, else decoded. Arguments as in `file_within`."""
    own = file_within(folder, beside, url) if "%" in url else None
    return url if own is not None and own.is_file() else unquote(url)
