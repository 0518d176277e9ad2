"""Class ids: the classes of a scene's parts as numbers."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.model import Scene


def class_ids(names: Iterable[str]) -> dict[str, int]:
    """Number the class `names` of all parts, from 1 in alphabetic order."""
    return {name: number for number, name in enumerate(sorted(set(names)), 1)}


def class_of_parts(scene: Scene) -> NDArray[np.uint16]:
    """Return (P + 1,) the class id of each part, by the part's id in labels; 0 is nothing."""
    names = [part.class_name for body in scene.bodies for part in body.target.parts]
    ids = class_ids(names)
    return np.array([0, *(ids[name] for name in names)], np.uint16)
