"""COCO as it lies: images, boxes, masks and keypoints, and poses where they are of our exports."""

from typing import Any

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget, MaskSource
from spin_usd.exchange.coco import ANNOTATIONS, HALF_PIXEL, HEAD, IMAGES
from spin_usd.exchange.sets.set_folder import LARGEST, SetFolder, number, numbers
from spin_usd.exchange.sets.set_format import SetFormat


def _recognises(folder: SetFolder) -> str:
    name = next(iter(_set_lists(folder)), "")
    return f"{name} begins as COCO's lists of images and annotations do" if name else ""


def _set_lists(folder: SetFolder) -> list[str]:
    names = [match.group() for match in folder.matching(r"(?:.*/)?(?!scene_gt_coco)[^/]+\.json")]
    return [name for name in names if HEAD.match(folder.head(name))]


def _read_set(folder: SetFolder) -> AnnotatedSet:
    pictures: list[AnnotatedPicture] = []
    classes: dict[str, str] = {}
    for name in _set_lists(folder):
        document = folder.json(name)
        document = document if isinstance(document, dict) else {}
        for each in _objects(document, "categories"):
            classes[str(each.get("id"))] = str(each.get("name"))
        by_image: dict[str, list[dict[str, Any]]] = {}
        for each in _objects(document, ANNOTATIONS):
            by_image.setdefault(str(each.get("image_id")), []).append(each)
        split = name.rpartition("/")[2].removesuffix(".json")
        images = _objects(document, IMAGES)
        if lost := by_image.keys() - {str(each.get("id")) for each in images}:
            folder.fault("files", name, f"{len(lost)} image_ids of annotations, such as {min(lost)}, are of no image")
        for place, image in enumerate(images):
            labels = by_image.get(str(image.get("id")), [])
            pictures.append(_picture(folder, image, labels, split, f"{name}, image {place}"))
    return AnnotatedSet(pictures=pictures, classes=classes, faults=folder.faults)


def _objects(document: dict[str, Any], section: str) -> list[dict[str, Any]]:
    found = document.get(section)
    return [each for each in found if isinstance(each, dict)] if isinstance(found, list) else []


def _picture(
    folder: SetFolder, image: dict[str, Any], labels: list[dict[str, Any]], split: str, place: str
) -> AnnotatedPicture:
    name = str(image.get("file_name"))
    file = folder.image(name, f"images/{split}/", f"{split}/", "images/")
    size = (int(number(image.get(side))) if number(image.get(side)) > 0 else 0 for side in ("height", "width"))
    height, width = size
    poses = {str(each.get("category_id")): each for each in _objects(image, "poses")}
    targets = [_target(each, poses.pop(str(each.get("category_id")), {}), (height, width)) for each in labels]
    targets += [_target({"category_id": key}, each, (height, width)) for key, each in poses.items()]
    return AnnotatedPicture(
        name=file or name,
        exists=bool(file),
        place=place,
        split=split,
        targets=tuple(targets),
        said_size=(width, height),
    )


def _target(said: dict[str, Any], pose: dict[str, Any], size: tuple[int, int]) -> AnnotatedTarget:
    box = numbers(said["bbox"], 4) if "bbox" in said else None
    points = said.get("keypoints")
    keypoints = numbers(points, len(points) // 3 * 3).reshape(-1, 3) if isinstance(points, list) else None
    if keypoints is not None:
        keypoints[keypoints[:, 2] > 0, :2] += HALF_PIXEL
    area = number(said.get("area"))
    return AnnotatedTarget(
        id=str(said.get("category_id")),
        rotation=numbers(pose["q_cam_body"], 4) if "q_cam_body" in pose else None,
        t_cam_body=numbers(pose["t_cam_body"], 3) if "t_cam_body" in pose else None,
        box=None if box is None else np.array([*box[:2], *(box[:2] + box[2:])]),
        mask=_mask(said.get("segmentation"), size),
        keypoints=keypoints,
        pixels=int(area) if area >= 0 else None,
    )


def _are_runs(counts: Any) -> bool:
    """Return whether the value is run lengths: text, or whole numbers."""
    whole = isinstance(counts, list) and all(type(each) is int and abs(each) < LARGEST for each in counts)
    return whole or isinstance(counts, str)


def _mask(said: Any, size: tuple[int, int]) -> MaskSource | None:
    if isinstance(said, dict) and _are_runs(said.get("counts")):
        stated = numbers(said.get("size"), 2)
        if np.isfinite(stated).all():
            size = (int(stated[0]), int(stated[1]))
        return MaskSource(size=size, counts=said["counts"])
    if isinstance(said, list) and said and all(isinstance(each, list) for each in said):
        return MaskSource(size=size, polygons=[numbers(each, len(each)).tolist() for each in said])
    return None


COCO_SET = SetFormat(name="coco", recognises=_recognises, read=_read_set)
