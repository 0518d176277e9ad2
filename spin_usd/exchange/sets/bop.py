"""BOP's scenes and SwissCube's as they lie: images, masks, depth, and the poses of all objects, in millimetres."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget, DepthSource, MaskSource
from spin_usd.basics.arrays import Float
from spin_usd.errors import SpinError
from spin_usd.exchange.layout.models import MILLIMETRES
from spin_usd.exchange.sets.set_folder import SetFolder, number, numbers
from spin_usd.exchange.sets.set_format import PoseFields, SetFormat
from spin_usd.geometry.camera import Camera

MOST_DIGITS = 19  # of an image's number
SCENE = r"(?P<at>(?:.*/)?)scene_gt(?P<sensor>(?!_info|_coco)(?:_[A-Za-z0-9-]+)?)\.json"
FIELDS = PoseFields(files=SCENE, rotation=("cam_R_m2c",), position=("cam_t_m2c",))


def _is_swisscube(folder: SetFolder, at: str) -> bool:
    return "/seq_" in f"/{at}"


def _recognises(swisscube: bool) -> Any:
    def reasons(folder: SetFolder) -> str:
        scenes = [match.group() for match in folder.matching(SCENE) if _is_swisscube(folder, match["at"]) == swisscube]
        where = "in a folder seq_NNNNNN as SwissCube's are" if swisscube else "as BOP's scenes are"
        return f"{scenes[0]} holds poses of objects by image, {where}" if scenes else ""

    return reasons


def _read(folder: SetFolder) -> AnnotatedSet:
    pictures: list[AnnotatedPicture] = []
    for match in folder.matching(SCENE):
        pictures += _scene(folder, match.group(), match["at"], match["sensor"])
    models = {str(int(match["id"])): match.group() for match in folder.matching(r"(?:.*/)?models/obj_(?P<id>\d+)\.ply")}
    return AnnotatedSet(pictures=pictures, models=models, model_unit=1 / MILLIMETRES, faults=folder.faults)


def _scene(folder: SetFolder, name: str, at: str, sensor: str) -> Iterator[AnnotatedPicture]:
    """Yield the images of the scene_gt.json of that `name`, which lies in the folder `at`; `sensor` ends its name."""
    poses, cameras = (_object(folder, each) for each in (name, f"{at}scene_camera{sensor}.json"))
    info = f"{at}scene_gt_info{sensor}.json"
    seen = _object(folder, info) if info in folder.files else {}
    for key, bodies in poses.items():
        if not (key.isdecimal() and len(key) < MOST_DIGITS) or not isinstance(bodies, list):
            folder.fault("unreadable", f"{name}, image {key!r}", "is no list of objects under a number")
            continue
        said = cameras.get(key)
        yield _picture(
            folder,
            scene=_Scene(name=name, at=at, sensor=sensor),
            key=key,
            bodies=[body if isinstance(body, dict) else {} for body in bodies],
            said=said if isinstance(said, dict) else {},
            seen=seen.get(key),
        )


@dataclass(frozen=True, kw_only=True)
class _Scene:
    """Where a scene is."""

    name: str
    """Its scene_gt.json."""
    at: str
    """Its folder, with a slash."""
    sensor: str
    """Ending of its folders and files where there are several cameras."""


def _picture(
    folder: SetFolder, *, scene: _Scene, key: str, bodies: list[dict[str, Any]], said: dict[str, Any], seen: Any
) -> AnnotatedPicture:
    at, sensor, file = scene.at, scene.sensor, f"{int(key):06d}"
    image = folder.image(file, *(f"{at}{kind}{sensor}/" for kind in ("rgb", "gray")))
    depth = folder.first(f"{at}depth{sensor}/{file}.png")
    masks = [folder.first(f"{at}mask_visib{sensor}/{file}_{place:06d}.png") for place in range(len(bodies))]
    targets = [_target(body, masks[place], _entry(seen, place)) for place, body in enumerate(bodies)]
    centre = 0.0 if _is_swisscube(folder, at) else 0.5
    return AnnotatedPicture(
        name=image or f"{at}rgb{sensor}/{file}",
        exists=bool(image),
        place=f"{scene.name}, image {key}",
        split=at.split("/")[0] if "/" in at.rstrip("/") else "",
        sequence=scene.name,
        camera=_camera(folder, image, said, centre, f"{at}scene_camera{sensor}.json, image {key}"),
        targets=tuple(targets),
        depth=DepthSource(file=depth, metres=number(said.get("depth_scale", 1.0)) / MILLIMETRES) if depth else None,
    )


def _target(body: dict[str, Any], mask: str, info: dict[str, Any]) -> AnnotatedTarget:
    box = numbers(info["bbox_visib"], 4) if "bbox_visib" in info else None
    if box is not None and (box[:2] >= 0).all():
        box = np.array([box[0], box[1], box[0] + box[2] + 1, box[1] + box[3] + 1])  # BOP: greatest pixel less the least
    elif box is not None:
        box = None
    visible, count, whole = (number(info.get(key)) for key in ("visib_fract", "px_count_visib", "px_count_all"))
    return AnnotatedTarget(
        id=str(body.get("obj_id", "")),
        rotation=numbers(body.get("cam_R_m2c"), 9).reshape(3, 3),
        t_cam_body=numbers(body.get("cam_t_m2c"), 3) / MILLIMETRES,
        box=box,
        mask=MaskSource(file=mask) if mask else None,
        visible=None if np.isnan(visible) else visible,
        pixels=int(count) if count >= 0 else None,
        whole=int(whole) if whole >= 0 else None,
    )


def _camera(folder: SetFolder, image: str, said: dict[str, Any], centre: float, where: str) -> Camera | None:
    K: Float = numbers(said.get("cam_K"), 9)
    size = folder.size(image) if image else None
    if size is None:
        return None
    try:
        return Camera(width=size[0], height=size[1], fx=K[0], fy=K[4], cx=K[2] + centre, cy=K[5] + centre)
    except SpinError as error:
        folder.fault("camera", where, error.found)
        return None


def _object(folder: SetFolder, name: str) -> dict[str, Any]:
    found = folder.json(name) if name in folder.files else None
    if not isinstance(found, dict):
        folder.fault("unreadable", name, "is not there" if name not in folder.files else "is no object of images")
        return {}
    return found


def _entry(info: Any, place: int) -> dict[str, Any]:
    there = isinstance(info, list) and place < len(info) and isinstance(info[place], dict)
    return info[place] if there else {}


BOP_SET = SetFormat(
    name="bop",
    recognises=_recognises(False),
    read=_read,
    fields=FIELDS,
)
SWISSCUBE_SET = SetFormat(name="swisscube", recognises=_recognises(True), read=_read, fields=FIELDS)
