"""YOLO as Ultralytics reads it, as it lies: a text file of labels beside each image, and poses of our exports."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget, MaskSource
from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.exchange.sets.set_folder import SetFolder, number, numbers
from spin_usd.exchange.sets.set_format import SetFormat
from spin_usd.exchange.speedplus import POSITION, QUATERNION
from spin_usd.exchange.yolo import POSES
from spin_usd.formats.yaml_file import read_yaml_file

MAX_LABELS = 1 << 22  # bytes of a file of labels
LABELS = r"(?:.*/)?labels/(?:(?P<split>[^/]+)/)?(?P<stem>[^/]+)\.txt"


def _recognises(folder: SetFolder) -> str:
    labels = folder.matching(LABELS)
    yaml = folder.first("data.yaml", "dataset.yaml")
    if not labels or not (yaml or re.match(r"\d+( [-+.\deE]+){4,}\s", folder.head(labels[0].group()) + "\n")):
        return ""
    beside = f" beside {yaml}" if yaml else ""
    return f"{labels[0].group()} holds lines of a class and shares{beside}, as Ultralytics has them"


def _read_set(folder: SetFolder) -> AnnotatedSet:
    yaml = folder.first("data.yaml", "dataset.yaml")
    said = _yaml(folder, yaml) if yaml else {}
    names = said.get("names") or []
    listed = names.items() if isinstance(names, dict) else enumerate(names if isinstance(names, list) else [])
    classes = {str(key): str(name) for key, name in listed}
    shape = numbers(said.get("kpt_shape"), 2)
    poses = {str(each.get("filename")): each for each in (folder.entries(POSES) if POSES in folder.files else [])}
    pictures = []
    for match in folder.matching(LABELS):
        split, stem = match["split"] or "", match["stem"]
        at = match.group().partition("labels/")[0]
        image = folder.image(stem, f"{at}images/{split}/" if split else f"{at}images/")
        size = folder.size(image) if image else None
        targets = _targets(folder, match.group(), shape, size, classes)
        pose = poses.get(image.rpartition("/")[2])
        if pose and (targets or len(classes) == 1):
            first = targets[0] if targets else AnnotatedTarget(id=next(iter(classes)))
            posed = replace(first, rotation=numbers(pose.get(QUATERNION), 4), t_cam_body=numbers(pose.get(POSITION), 3))
            targets = [posed, *targets[1:]]
        pictures.append(
            AnnotatedPicture(
                name=image or f"{stem}", exists=bool(image), place=match.group(), split=split, targets=tuple(targets)
            )
        )
    return AnnotatedSet(pictures=pictures, classes=classes, faults=folder.faults)


def _yaml(folder: SetFolder, name: str) -> dict[str, Any]:
    try:
        return read_yaml_file(folder.root / name)
    except InputError as error:
        folder.fault("unreadable", name, error.found)
        return {}


def _targets(
    folder: SetFolder, name: str, shape: Float, size: tuple[int, int] | None, classes: Mapping[str, str]
) -> list[AnnotatedTarget]:
    """Return the targets of a file of labels; without the image's `size`, in shares of it."""
    found, scale = [], np.array(size or (1, 1), np.float64)
    for line, text in enumerate(folder.head(name, MAX_LABELS).splitlines(), 1):
        words = text.split()
        values = np.array([number(word) for word in words[1:]])
        if len(values) < 4 or not np.isfinite(values).all():
            if words:
                folder.fault("unreadable", f"{name}, line {line}", "is no class and four numbers or more")
            continue
        points, box, mask = None, None, None
        count = int(shape[0] * shape[1]) if shape[0] >= 1 and shape[1] in (2, 3) else 0
        if len(values) == 4 or len(values) == 4 + count:
            box = np.concatenate([values[:2] - values[2:4] / 2, values[:2] + values[2:4] / 2]) * np.tile(scale, 2)
            if count:
                points = values[4:].reshape(-1, int(shape[1]))
                points = np.column_stack(
                    [points[:, :2] * scale, points[:, 2] if points.shape[1] > 2 else points[:, 0] > 0]
                )
        elif len(values) % 2 == 0 and size:
            outline = values.reshape(-1, 2) * scale
            mask = MaskSource(size=(size[1], size[0]), polygons=[outline.ravel().tolist()])
        else:
            folder.fault("unreadable", f"{name}, line {line}", f"holds {len(values)} numbers after the class")
        found.append(AnnotatedTarget(id=words[0], box=box, mask=mask, keypoints=points))
    return found


YOLO_SET = SetFormat(name="yolo", recognises=_recognises, read=_read_set)
