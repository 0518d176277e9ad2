"""KITTI's raw recordings as they lie: images with a calibration, timestamps and depth, and no poses of a target."""

import re
from collections import Counter
from datetime import datetime
from math import nan

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, DepthSource
from spin_usd.errors import SpinError
from spin_usd.exchange.kitti import FIRST_CENTRE, STEPS
from spin_usd.exchange.sets.set_folder import SetFolder, numbers
from spin_usd.exchange.sets.set_format import SetFormat
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.geometry.camera import Camera

IMAGE = r"(?P<drive>.*_sync)/image_(?P<camera>\d\d)/data/(?P<number>\d+)\.(?:png|jpg)"


def _recognises(folder: SetFolder) -> str:
    images = folder.matching(IMAGE)
    return f"{images[0].group()} lies where KITTI's raw recordings have images" if images else ""


def _read(folder: SetFolder) -> AnnotatedSet:
    pictures: list[AnnotatedPicture] = []
    cameras, times, counts = dict[str, Camera | None](), dict[str, list[float]](), Counter[str]()
    for match in folder.matching(IMAGE):
        drive, camera = match["drive"], match["camera"]
        at = f"{drive}/image_{camera}"
        if at not in cameras:
            cameras[at], times[at] = _camera(folder, drive, camera), _times(folder, f"{at}/timestamps.txt")
            images = folder.matching(rf"{re.escape(at)}/data/.*")
            if times[at] and len(times[at]) != len(images):
                message = f"has {len(times[at])} timestamps for {len(images)} images"
                folder.fault("files", f"{at}/timestamps.txt", message)
        place = counts[at]
        counts[at] += 1
        depth = folder.first(f"{drive}/proj_depth/groundtruth/image_{camera}/{match['number']}.png")
        pictures.append(
            AnnotatedPicture(
                name=match.group(),
                exists=True,
                place=f"{at}/timestamps.txt, line {place + 1}",
                sequence=at,
                camera=cameras[at],
                depth=DepthSource(file=depth, metres=1 / STEPS) if depth else None,
                time=times[at][place] if place < len(times[at]) else None,
            )
        )
    return AnnotatedSet(pictures=pictures, faults=folder.faults)


def _camera(folder: SetFolder, drive: str, camera: str) -> Camera | None:
    above = "".join(drive.rpartition("/")[:2])
    if not (name := folder.first(f"{above}calib_cam_to_cam.txt", f"{drive}/calib_cam_to_cam.txt")):
        folder.fault("camera", drive, "has no calib_cam_to_cam.txt")
        return None
    lines = (line.partition(":") for line in folder.head(name, MAX_POSE_LIST).splitlines())
    said = {key.strip(): text.split() for key, _, text in lines}
    P, size = numbers(said.get(f"P_rect_{camera}"), 12), numbers(said.get(f"S_rect_{camera}"), 2)
    try:
        width, height = (int(each) if each == each else 0 for each in size)
        shift = 0.5 - FIRST_CENTRE
        return Camera(width=width, height=height, fx=P[0], fy=P[5], cx=P[2] + shift, cy=P[6] + shift)
    except SpinError as error:
        folder.fault("camera", name, error.found)
        return None


def _times(folder: SetFolder, name: str) -> list[float]:
    found = []
    for text in folder.head(name, MAX_POSE_LIST).splitlines() if name in folder.files else []:
        try:
            found.append(datetime.fromisoformat(text.strip()[:26]).timestamp())
        except (ValueError, OverflowError):
            found.append(nan)
    return found


KITTI_SET = SetFormat(name="kitti", recognises=_recognises, read=_read)
