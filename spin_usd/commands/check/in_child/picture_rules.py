"""The rules on each picture of a dataset. A new one is a file of its own and an entry here."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from spin_usd.commands.check.digests import MAKE_AGAIN
from spin_usd.commands.check.in_child.boxes import box_findings
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.keypoints import keypoint_findings
from spin_usd.commands.check.in_child.labels import label_findings
from spin_usd.commands.check.in_child.pixel_counts import count_findings
from spin_usd.commands.check.in_child.pose import pose_findings
from spin_usd.picture.brightness import tone_findings
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


def brightness_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Return a warning for each reason why little of the target shows."""
    return tone_findings(picture.record, picture.where)


PICTURE_RULES: tuple[Callable[[CheckedPicture], Iterator[Finding]], ...] = (
    target_id_findings,
    brightness_findings,
    label_findings,
    pose_findings,
    box_findings,
    count_findings,
    keypoint_findings,
)
"""The rules, in the order in which their findings are reported."""
