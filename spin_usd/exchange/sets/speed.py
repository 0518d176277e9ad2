"""SPEED and its kin as they lie: SPEED, SPEED+, SHIRT, SPEED-UE-Cube and SPE3R, whose lists of poses are one format.

They differ in where the images lie, and in what else there is. Sources: tpark94/speedplusbaseline, tpark94/spnv2,
tpark94/speed-ue-cube-baseline and tpark94/sat-sq-recon (SPE3R: labels.json, images, masks and models of each craft,
file names without endings).
"""

from collections.abc import Callable, Iterator
from functools import cache
from math import isfinite
from typing import Any

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget, MaskSource
from spin_usd.errors import SpinError
from spin_usd.exchange.cameras.speed_camera import read_camera_file
from spin_usd.exchange.sets.set_folder import SetFolder, number, numbers
from spin_usd.exchange.sets.set_format import PoseFields, SetFormat
from spin_usd.geometry.camera import Camera

LIST = r"(?:(?P<at>.*)/)?(?P<split>[^/]+)\.json"
QUATERNION, POSITION = ("q_vbs2tango_true", "q_vbs2tango"), ("r_Vo2To_vbs_true", "r_Vo2To_vbs")
SPEED_CAMERA = Camera(width=1920, height=1200, fx=0.0176 / 5.86e-6, fy=0.0176 / 5.86e-6, cx=960, cy=600)
"""SPEED (2019) has no camera file; tpark94/speedplusbaseline has its numbers."""
DOMAINS = ("synthetic", "lightbox", "sunlamp")
FIELDS = PoseFields(files=LIST, rotation=QUATERNION, position=POSITION, name="filename")


def _lists(folder: SetFolder) -> Iterator[tuple[str, str, str]]:
    """Yield each list of poses, the folder that it is in, with a slash, and its split."""
    for match in folder.matching(LIST):
        head = folder.head(match.group())
        if '"filename"' in head and any(f'"{key}"' in head for key in (*QUATERNION, *POSITION)):
            yield match.group(), f"{match['at']}/" if match["at"] else "", match["split"]


def _recognised(of: Callable[[SetFolder, str, str, str], bool], why: str) -> Callable[[SetFolder], str]:
    """Return a function that names the first list `of` the layout with the reason `why`."""

    def reasons(folder: SetFolder) -> str:
        name = next((name for name, at, split in _lists(folder) if of(folder, name, at, split)), "")
        return f"{name} holds file names with quaternions and positions as SPEED has them, {why}" if name else ""

    return reasons


def _images(folder: SetFolder, at: str, split: str) -> list[str]:
    domains = [f"{at}{domain}/images/" for domain in DOMAINS]
    return [f"{at}images/{split}/", f"{at}images/", *domains, f"{at}{split}/images/", at]


def _read(folder: SetFolder) -> AnnotatedSet:
    pictures: list[AnnotatedPicture] = []
    craft: dict[str, str] = {}
    camera = cache(lambda at, old: _camera(folder, at, old))
    for name, at, split in _lists(folder):
        target = at.rstrip("/").rpartition("/")[2] if split == "labels" else "target"
        if model := folder.first(f"{at}models/model_normalized.obj", f"{at}model/model_normalized.obj"):
            craft[target] = model
        folders = _images(folder, at, split)
        for place, entry in enumerate(folder.entries(name)):
            lens = camera(at, QUATERNION[0] not in entry)
            pictures.append(_picture(folder, entry, f"{name}, entry {place}", split, folders, lens, target))
    return AnnotatedSet(pictures=pictures, models=craft, faults=folder.faults)


def _picture(
    folder: SetFolder,
    entry: dict[str, Any],
    place: str,
    split: str,
    folders: list[str],
    camera: Camera | None,
    target: str,
) -> AnnotatedPicture:
    said = entry.get("filename")
    image = folder.image(said, *folders) if isinstance(said, str) else ""
    rotation, position = (
        next((numbers(entry[key], count) for key in keys if key in entry), None)
        for keys, count in ((QUATERNION, 4), (POSITION, 3))
    )
    stem = image.replace("/images/", "/masks/").rpartition(".")[0]
    mask = folder.first(f"{stem}.png", f"{stem}.jpg") if "/masks/" in f"/{stem}" else ""
    time = number(entry.get("time"))
    return AnnotatedPicture(
        name=image or str(said),
        exists=bool(image),
        place=place,
        split=split,
        sequence=place.rpartition(",")[0],
        camera=camera,
        targets=(
            AnnotatedTarget(
                id=target, rotation=rotation, t_cam_body=position, mask=MaskSource(file=mask) if mask else None
            ),
        ),
        time=time if isfinite(time) else None,
    )


def _camera(folder: SetFolder, at: str, old: bool) -> Camera | None:
    """Return the camera of the nearest camera.json; SPEED's own if lists are `old` and there is none."""
    parts = at.rstrip("/").split("/") if at else []
    above = ["/".join([*parts[:count], "camera.json"]) for count in range(len(parts), -1, -1)]
    if not (name := folder.first(*above)):
        return SPEED_CAMERA if old else None
    try:
        return read_camera_file(folder.root / name).camera
    except SpinError as error:
        folder.fault("camera", name, error.found)
        return None


def _is_spe3r(folder: SetFolder, name: str, at: str, split: str) -> bool:
    return split == "labels"


def _is_shirt(folder: SetFolder, name: str, at: str, split: str) -> bool:
    return split in ("roe1", "roe2")


def _is_speed(folder: SetFolder, name: str, at: str, split: str) -> bool:
    return f'"{QUATERNION[1]}"' in folder.head(name)


def _format(name: str, of: Callable[[SetFolder, str, str, str], bool], why: str) -> SetFormat:
    return SetFormat(name=name, recognises=_recognised(of, why), read=_read, fields=FIELDS)


SPE3R_SET = _format("spe3r", _is_spe3r, "in labels.json of each craft")
SHIRT_SET = _format("shirt", _is_shirt, "and is named as SHIRT's trajectories are")
SPEED_SET = _format("speed", _is_speed, "under q_vbs2tango")
SPEEDPLUS_SET = _format("speedplus", lambda *_: True, "under q_vbs2tango_true")
