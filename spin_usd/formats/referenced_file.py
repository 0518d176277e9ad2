"""Files that a model names, as exporters of any system write their paths."""

from pathlib import Path

from spin_usd.files.user_file import names_in


def file_within(folder: Path, beside: Path, named: str) -> Path | None:
    """Return the path of the file that something in the folder `beside` calls `named`: "x.mtl", "./x.mtl", or with
    backslashes.

    None when that is outside `folder`, links followed, or can be no path; what is returned need not exist. Where there
    is no such file, but one whose name differs by capitals alone, which is the same to Windows, that one is returned.
    """
    path = Path(named.replace("\\", "/"))
    try:
        full = (beside / path).resolve()
    except ValueError:  # NUL, or what no file system's encoding has
        return None
    if path.is_absolute() or ":" in named or not full.is_relative_to(folder.resolve()):
        return None
    if full.exists():
        return full
    found = folder.resolve()
    for part in full.relative_to(found).parts:
        found /= next((name for name in names_in(found) if name.lower() == part.lower()), part)
    return found if found.resolve().is_relative_to(folder.resolve()) else None
