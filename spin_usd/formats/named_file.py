"""Files that a model names, as exporters of any system write their paths."""

from pathlib import Path


def file_within(folder: Path, beside: Path, named: str) -> Path | None:
    """Return the path of the file that something in the folder `beside` calls `named`: "x.mtl", "./x.mtl", or with
    backslashes.

    None when that is outside `folder`, links followed; what is returned need not exist.
    """
    path = Path(named.replace("\\", "/"))
    full = (beside / path).resolve()
    outside = path.is_absolute() or ":" in named or not full.is_relative_to(folder.resolve())
    return None if outside else full
