"""The cameras of a stage: their files, and how those beside the first are mounted."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spin_usd.basics.faults import reading
from spin_usd.basics.resources import bundled
from spin_usd.commands.author.model import USD_SUFFIXES
from spin_usd.errors import GeometryError, InputError
from spin_usd.exchange.read_camera import lens_in_words, read_camera
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.geometry.transform import Transform
from spin_usd.stage.author.camera_layer import (
    FurtherCamera,
    camera_layer_of,
    lens_of,
    read_camera_layer,
    set_resolution,
)
from spin_usd.stage.usd.layer_file import Layer

CALIBRATIONS = (".json", ".yaml", ".yml", ".txt")
NAME = re.compile("[a-z][a-z0-9_]*")
FORMS = "write NAME_OR_FILE:X,Y,Z, :QW,QX,QY,QZ,X,Y,Z or :FILE of one pose: metres, in the first camera's axes"
ROUNDED = 1e-3  # of a quaternion's norm: rounding to three decimals


@dataclass(frozen=True, kw_only=True, eq=False)
class ChosenCameras:
    """The cameras that a user chose."""

    layer: Layer
    """The first one's."""
    name: str
    """The first one's; "" where none was given."""
    further: tuple[FurtherCamera, ...]
    """Cameras after the first."""
    files: dict[str, Path]
    """All of them by their roles, and the pose lists."""
    notes: tuple[str, ...]
    """Notes on reading the camera."""


def open_cameras(given: Sequence[str], resolution: str | None) -> ChosenCameras:
    """Open the cameras of "NAME_OR_FILE", and "NAME_OR_FILE:POSE" after the first, each optionally after "NAME=". They
    get the size in `resolution`, if given. Raises InputError."""
    first_name, first = _named(given[0])
    layer, files, notes = _opened(first, "camera", resolution)
    further: list[FurtherCamera] = []
    for number, each in enumerate(given[1:], 2):
        name, rest = _named(each)
        source, colon, place = rest.rpartition(":")
        if not colon:
            raise InputError("is a further camera without a pose", where=each, do=FORMS)
        T_first_cam, lists = mounting(place)
        other, found, more = _opened(source, f"camera_{number}", resolution)
        files |= found | {f"camera_{number}_pose": file for file in lists}
        notes += more
        name = name or _plain(Path(source).stem)
        if name in (first_name or "camera", *(camera.name for camera in further)):
            do = f"name it: --camera {name}_{number}={rest}"
            raise InputError(f"two cameras are called {name!r}", where=each, do=do)
        further.append(FurtherCamera(name=name, layer=other, T_first_cam=T_first_cam))
    return ChosenCameras(layer=layer, name=first_name, further=tuple(further), files=files, notes=notes)


def _named(given: str) -> tuple[str, str]:
    """Return the name before "=", "" if there is none, and the rest."""
    name, equals, rest = given.partition("=")
    if not equals or Path(given).is_file():
        return "", given
    if not NAME.fullmatch(name):
        found = f"{name!r} cannot name a camera"
        raise InputError(found, where=given, do="use small letters, digits and '_', the first a letter")
    return name, rest


def _plain(stem: str) -> str:
    """Return a camera's name from its file's."""
    name = re.sub("[^a-z0-9_]+", "_", stem.lower())
    return name if NAME.fullmatch(name) else f"camera_{name}"


def _opened(given: str, role: str, resolution: str | None) -> tuple[Layer, dict[str, Path], tuple[str, ...]]:
    """Open the layer of the camera of that name or in that file; return it with the file by its `role`, and notes."""
    with reading(given):
        layer, file, notes = open_camera(given)
    if resolution is not None:
        notes += set_resolution(layer, resolution)
    return layer, {role: file}, notes


def open_camera(given: str) -> tuple[Layer, Path, tuple[str, ...]]:
    """Open the layer of the camera of that name or in that file, the file it comes from, and notes on that. Raises
    InputError."""
    suffix = Path(given).suffix.lower()
    if suffix not in USD_SUFFIXES and (suffix in CALIBRATIONS or Path(given).exists()):
        found = read_camera(given)
        documentation = f"The calibration in {Path(given).name}."
        layer = camera_layer_of(found.camera, pixel_pitch=found.pixel_pitch, documentation=documentation)
        return layer, Path(given), found.notes
    path = Path(given) if suffix in USD_SUFFIXES else bundled("camera", given)
    layer, foreign = read_camera_layer(path)
    if not foreign:
        return layer, path, ()
    lens = lens_of(layer)
    said = f"{lens_in_words(lens)} of {lens.width} x {lens.height} pixels with its fx, fy, cx and cy at"
    numbers = ", ".join(f"{number:.9g}" for number in (lens.fx, lens.fy, lens.cx, lens.cy))
    return layer, path, (f"{path.name} is read by NVIDIA's names, as {foreign}: {said} {numbers}",)


def mounting(given: str) -> tuple[Transform, tuple[Path, ...]]:
    """Return the pose in a camera's axes that numbers or a pose list give, and the file of that. Raises InputError."""
    if not given:
        raise InputError("the pose after ':' is empty", do=FORMS)
    numbers = given.split(",")
    if len(numbers) not in (3, 7):
        if not Path(given).exists():
            raise InputError(f"{given!r} is neither a pose nor a file", do=FORMS)
        with reading(given):
            poses = read_pose_list(given)
        if len(poses) != 1:
            raise InputError(f"has {len(poses)} poses, and a camera is mounted by one", where=given, do=FORMS)
        q, t = poses.q_cam_body[0], poses.t_cam_body[0]
        return Transform.from_quaternion(to="cam", of="cam", q=q, t=t), (Path(given),)
    try:
        values = np.array([float(number) for number in numbers])
        q = values[:-3] if len(values) == 7 else np.array([1.0, 0, 0, 0])
        norm = float(np.linalg.norm(q))
        if abs(norm - 1) > ROUNDED:
            raise GeometryError(f"its quaternion has norm {norm:.6g}, expected 1")
        return Transform.from_quaternion(to="cam", of="cam", q=q / norm, t=values[-3:]), ()
    except GeometryError as error:
        raise InputError(error.found, where=given, do=FORMS) from None
    except ValueError:
        raise InputError(f"{given!r} contains text that is not a number", do=FORMS) from None
