"""Changes of a list of keypoints: each gives a new list, and refuses names that a dataset could not have."""

import csv
from dataclasses import replace
from io import StringIO

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.scene.keypoints import Keypoints

MAX_NAME = 64  # characters: a longer name is unreadable in a list
MAX_DIGITS = 9  # of a number at a name's end: a layer of others may hold a name of thousands
FIRST_NAME = "point_1"


def added(keypoints: Keypoints, name: str, point: Float) -> Keypoints:
    """Return the keypoints and one more. Raises InputError for a name that is taken or not valid."""
    _require_free(keypoints, name)
    return Keypoints(names=(*keypoints.names, name), points=np.concatenate([keypoints.points, point[None]]))


def renamed(keypoints: Keypoints, old: str, new: str) -> Keypoints:
    """Return the keypoints with another name for one. Raises InputError for a name that is taken or not valid."""
    if old == new:
        return keypoints
    _require_free(keypoints, new)
    return replace(keypoints, names=tuple(new if name == old else name for name in keypoints.names))


def moved(keypoints: Keypoints, name: str, point: Float) -> Keypoints:
    """Return the keypoints with one at another place (3,)."""
    points = keypoints.points.copy()
    points[keypoints.names.index(name)] = point
    return replace(keypoints, points=points)


def deleted(keypoints: Keypoints, name: str) -> Keypoints:
    """Return the keypoints without one."""
    place = keypoints.names.index(name)
    names = (*keypoints.names[:place], *keypoints.names[place + 1 :])
    return Keypoints(names=names, points=np.delete(keypoints.points, place, axis=0))


def free_name(keypoints: Keypoints, like: str) -> str:
    """Return a name that no keypoint has: `like`, its number counted on, or given one, as far as is needed."""
    stem = like[:-MAX_DIGITS] + like[-MAX_DIGITS:].rstrip("0123456789")
    number = int(like[len(stem) :] or 0)
    name = like
    while name in keypoints.names:
        number += 1
        name = f"{stem}{number}" if stem.endswith("_") or stem != like else f"{like}_{number}"
    return name


def next_name(keypoints: Keypoints) -> str:
    """Return a free name for one more keypoint, counted on from the last one's."""
    return free_name(keypoints, keypoints.names[-1] if keypoints.names else FIRST_NAME)


def table_lines(keypoints: Keypoints) -> list[str]:
    """Return the lines of a CSV table of the keypoints, to the last digit."""
    table = StringIO()
    rows = ((name, *point) for name, point in zip(keypoints.names, keypoints.points.tolist(), strict=True))
    csv.writer(table).writerows([("name", "x", "y", "z"), *rows])
    return table.getvalue().splitlines()


def _require_free(keypoints: Keypoints, name: str) -> None:
    if not name or name != name.strip() or not name.isprintable() or len(name) > MAX_NAME:
        do = f"give 1 to {MAX_NAME} printable characters without blanks around them"
        raise InputError(f"{name!r} cannot name a keypoint", do=do)
    if name in keypoints.names:
        raise InputError(f"there is a keypoint named {name!r} already", do="give another name")
