"""The layouts of others' data sets that `check` reads, and which of them a folder has.

A new one is a file of its own, or a part of its format's, and an entry here.
"""

import re
from dataclasses import replace
from pathlib import Path

from spin_usd.audit.annotated_set import AnnotatedSet
from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.exchange.sets.bop import BOP_SET, SWISSCUBE_SET
from spin_usd.exchange.sets.coco import COCO_SET
from spin_usd.exchange.sets.kitti import KITTI_SET
from spin_usd.exchange.sets.set_folder import IMAGES, SetFolder
from spin_usd.exchange.sets.set_format import SetFormat
from spin_usd.exchange.sets.spacesense import SPACESENSE_SET
from spin_usd.exchange.sets.spark import SPARK_SET
from spin_usd.exchange.sets.speed import SHIRT_SET, SPE3R_SET, SPEED_SET, SPEEDPLUS_SET
from spin_usd.exchange.sets.urso import URSO_SET
from spin_usd.exchange.sets.yolo import YOLO_SET

NUMBERS = re.compile(r"\d+")
SET_FORMATS: tuple[SetFormat, ...] = (
    SPACESENSE_SET,
    SWISSCUBE_SET,
    BOP_SET,
    URSO_SET,
    SPARK_SET,
    KITTI_SET,
    COCO_SET,
    YOLO_SET,
    SPE3R_SET,
    SHIRT_SET,
    SPEED_SET,
    SPEEDPLUS_SET,
)
"""In the order in which they are tried: the most particular first."""


def guessed(folder: SetFolder, name: str | None) -> tuple[SetFormat, list[str]]:
    """Return the layout of that name, or the first that recognises the folder, and sentences on why. Raises
    InputError."""
    if name is not None:
        found = next((each for each in SET_FORMATS if each.name == name), None)
        if found is None:
            do = suggestion(name, [each.name for each in SET_FORMATS])
            raise InputError(f"there is no layout {name!r}", do=do)
        return found, [f"read as {found.name}, as --layout says"]
    reasons = {each: why for each in SET_FORMATS if (why := each.recognises(folder))}
    if not reasons:
        names = ", ".join(each.name for each in SET_FORMATS)
        do = (
            f"give a stage, a dataset of spin-usd, or a folder in one of the layouts {names}; --layout NAME chooses one"
        )
        raise InputError("is neither a stage nor a dataset, and has no known layout", where=folder.root, do=do)
    first, *others = reasons
    notes = [f"read as {first.name}: {reasons[first]}"]
    others = [each for each in others if each.read is not first.read]
    return first, notes + [
        f"could also be {each.name}: {reasons[each]}; --layout {each.name} reads it so" for each in others
    ]


def read_set(root: Path, name: str | None) -> tuple[AnnotatedSet, SetFormat, list[str]]:
    """Read the data set in the folder in the layout of that `name`, or in the guessed one. Raises InputError."""
    folder = SetFolder(root)
    found, notes = guessed(folder, name)
    labels = found.read(folder)
    return replace(labels, unlabelled=_unlabelled(folder, labels), renamed=folder.renamed), found, notes


def _unlabelled(folder: SetFolder, labels: AnnotatedSet) -> list[str]:
    """Return images that lie beside labelled ones, have names like theirs, and are in no list."""
    listed = {picture.name for picture in labels.pictures if picture.exists}
    like = {NUMBERS.sub("0", name) for name in listed}
    masks = {target.mask.file for each in labels.pictures for target in each.targets if target.mask}
    beside = (file for file in folder.files if file.lower().endswith(IMAGES) and NUMBERS.sub("0", file) in like)
    return sorted(set(beside) - listed - masks)
