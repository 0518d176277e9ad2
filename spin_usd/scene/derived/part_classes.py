"""Class ids: the classes of a scene's parts as numbers."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.scene import Scene


def class_ids(names: Iterable[str]) -> dict[str, int]:
    """Number the class `names` of all parts, from 1 in alphabetic order."""
    return {name: number for number, name in enumerate(sorted(set(names)), 1)}


def class_of_parts(scene: Scene) -> NDArray[np.uint16]:
    """Return (P + 1,) the class id of each part, by the part's id in labels; 0 is nothing. The classes cover the whole
    stage, also bodies hidden here, as far as the scene knows them."""
    each = zip(scene.bodies, scene.part_offsets, strict=True)
    shown = {before + part.id: part.class_name for body, before in each for part in body.target.parts}
    names = dict(enumerate(scene.classes, 1)) or shown
    ids, found = class_ids(names.values()), np.zeros(max(names, default=0) + 1, np.uint16)
    found[list(names)] = [ids[name] for name in names.values()]
    return found
