"""Rule: a target has the same id in every record, that of dataset.json."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from spin_usd.dataset.check.digests import MAKE_AGAIN
from spin_usd.dataset.check.in_child.checked_picture import CheckedPicture
from spin_usd.scene.finding import Finding


def target_id_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield an error where the ids of the record's targets, or their names, are not those of dataset.json: the
    picture's labels then mean other targets than the dataset says."""
    there, here = (_names(each["targets"]) for each in (picture.description, picture.record))
    if there != here:
        found = f"its targets are {_in_words(here)}, but dataset.json has {_in_words(there)}"
        yield Finding(code="target-ids", where=picture.where, message=f"{found}; {MAKE_AGAIN}")


def _names(targets: Iterable[Mapping[str, Any]]) -> dict[int, str]:
    return {target["id"]: target["name"] for target in targets}


def _in_words(names: dict[int, str]) -> str:
    return ", ".join(f"{number} {name!r}" for number, name in sorted(names.items()))
