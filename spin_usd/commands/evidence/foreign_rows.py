"""The rows of a data set of somebody else that `check` reads: values from its poses and labels."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from spin_usd.audit.posed_targets import AuditedSet, PosedTargets
from spin_usd.audit.readings import Reading
from spin_usd.commands.check.foreign_set import CheckedSet, checked_set
from spin_usd.commands.check.options import CheckOptions
from spin_usd.commands.evidence.calls import PictureRow
from spin_usd.commands.evidence.options import EvidenceOptions
from spin_usd.errors import InputError


def checked_foreign_set(options: EvidenceOptions) -> CheckedSet:
    """Check the data set of somebody else. Raises InputError for --also, and for a set without poses or camera."""
    root = Path(options.dataset)
    if options.also:
        raise InputError("is given with a data set of others", where="--also", do="leave it out")
    checked = checked_set(root, CheckOptions(root, camera=options.camera, on_progress=options.on_progress))
    if not checked.audited.posed:
        do = "give --camera if the set holds no camera"
        raise InputError("has no pose with a camera, which evidence needs", where=root, do=do)
    return checked


def foreign_rows(audited: AuditedSet) -> list[PictureRow]:
    """Return a row for each picture: of its first target with a pose, of none for pictures without."""
    rows: dict[str, PictureRow] = {}
    for targets in audited.posed.values():
        for row in _rows(targets):
            rows.setdefault(row.name, row)
    return [rows.get(picture.name, PictureRow(name=picture.name, variant="")) for picture in audited.pictures]


def _rows(targets: PosedTargets) -> Iterator[PictureRow]:
    R, t = Reading().poses(targets)
    for (picture, _, target, _), rotation, place, box in zip(targets.rows, R, t, targets.boxes, strict=True):
        distance = float(np.linalg.norm(place))
        sight = place / max(distance, 1e-30)
        across = rotation[:, 2] - (rotation[:, 2] @ sight) * sight
        x, y, z = (-rotation.T @ sight).tolist()
        side = float(max(box[2] - box[0], box[3] - box[1]))
        yield PictureRow(
            name=picture.name,
            variant=picture.labels.split,
            range=distance,
            attitude=(x, y, z),
            roll=float(np.degrees(np.arctan2(across[0], -across[1])) % 360),
            visible=target.visible,
            size=side if np.isfinite(side) else None,
        )
