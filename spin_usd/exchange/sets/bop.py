"""BOP's scenes and SwissCube's as they lie: images, masks, depth, and the poses of all objects, in millimetres."""

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


def _scene(folder: SetFolder, name: str, at: str, sensor: str) -> list[AnnotatedPicture]:
    poses = _object(folder, name)
    cameras = _object(folder, f"{at}scene_camera{sensor}.json")
    seen = (
        _object(folder, f"{at}scene_gt_info{sensor}.json") if f"{at}scene_gt_info{sensor}.json" in folder.files else {}
    )
    centre = 0.0 if _is_swisscube(folder, at) else 0.5
    found = []
    for key, bodies in poses.items():
        if not (key.isdecimal() and len(key) < MOST_DIGITS) or not isinstance(bodies, list):
            folder.fault("unreadable", f"{name}, image {key!r}", "is no list of objects under a number")
            continue
        file = f"{int(key):06d}"
        image = folder.image(file, *(f"{at}{kind}{sensor}/" for kind in ("rgb", "gray")))
        said = cameras.get(key)
        camera = _camera(
            folder, image, said if isinstance(said, dict) else {}, centre, f"{at}scene_camera, image {key}"
        )
        info = seen.get(key)
        depth = folder.first(f"{at}depth{sensor}/{file}.png")
        targets = [
            _target(folder, body if isinstance(body, dict) else {}, place, _entry(info, place), f"{at}|{sensor}|{file}")
            for place, body in enumerate(bodies)
        ]
        scale = number(said.get("depth_scale", 1.0)) if isinstance(said, dict) else 1.0
        found.append(
            AnnotatedPicture(
                name=image or f"{at}rgb{sensor}/{file}",
                exists=bool(image),
                place=f"{name}, image {key}",
                split=at.split("/")[0] if "/" in at.rstrip("/") else "",
                sequence=name,
                camera=camera,
                targets=tuple(targets),
                depth=DepthSource(file=depth, metres=scale / MILLIMETRES) if depth else None,
            )
        )
    return found


def _target(folder: SetFolder, body: dict[str, Any], place: int, info: dict[str, Any], at: str) -> AnnotatedTarget:
    scene, sensor, file = at.split("|")
    mask = folder.first(f"{scene}mask_visib{sensor}/{file}_{place:06d}.png")
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
    holds="BOP: scenes of images, masks, depth, poses",
    recognises=_recognises(False),
    read=_read,
    fields=FIELDS,
)
SWISSCUBE_SET = SetFormat(
    name="swisscube", holds="SwissCube: sequences of scenes", recognises=_recognises(True), read=_read, fields=FIELDS
)
