"""BOP: scenes of images, depth and masks with the poses of all bodies, and the bodies' models, in millimetres.

Its poses, and SwissCube's, are in scene_gt.json, an object of images; each lists its bodies with R_cam_body
row by row and t_cam_body in millimetres. A picture that is read is called after its scene's folder and its number.
Source: the description of the format in bop_toolkit (docs/bop_datasets_format.md).
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET

from spin_usd.basics.arrays import Float
from spin_usd.basics.pluralise import pluralise
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.bop_scenes import (
    POSES_TO_CAMERA,
    camera_matrix,
    depth_file,
    image_file,
    image_number,
    mask_file,
    model_files,
    pose_entry,
    scene_indexes,
    scene_rows,
    visibility_entry,
)
from spin_usd.exchange.cameras.camera_format import Calibration, CameraFormat, whole
from spin_usd.exchange.layout.export_format import (
    ExportFile,
    ExportFormat,
    FormatOption,
    IndexRow,
    Layout,
    MadeFile,
    Output,
)
from spin_usd.exchange.layout.exported_dataset import AMODAL, ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.index_file import IndexFile, json_list, write_json_file
from spin_usd.exchange.layout.limits import INSTANCE, UINT16_MAX, bodies_told_apart, depth_at_most, undistorted
from spin_usd.exchange.layout.models import MILLIMETRES, body_models
from spin_usd.exchange.layout.rectified_picture import RECTIFIED, RECTIFY, RECTIFY_IT, RECTIFYING, YES, as_exported
from spin_usd.exchange.layout.survey import Survey, reach
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import finite_numbers, quaternion_of
from spin_usd.files.size_limits import MAX_POSE_LIST, MAX_SPECIFICATION
from spin_usd.formats.json_file import read_json_file
from spin_usd.geometry.bounds import in_front
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.reading.pictured_target import PicturedTarget
from spin_usd.scene.body import OCCLUDER
from spin_usd.scene.scene import augmentation_and_camera

DEPTH = "depth"
SPLITS = {"train": "train", "validation": "val", "test": "test"}
INDEXES = ("scene_camera", "scene_gt", "scene_gt_info")
TARGETS = "test_targets_bop19.json"
SEEN = 0.1  # of a body must be visible for BOP's challenge to require its pose
FIRST_CENTRE = 0.0  # where the first pixel has its centre, as in OpenCV
CONVENTIONS = (
    "Lengths are millimetres: poses, models and their boxes and diameters. A depth image times its depth_scale is "
    "millimetres along the camera's axis; 0 is nothing.",
    POSES_TO_CAMERA,
    "cam_K, and cx and cy in camera.json, are in pixels whose centres are at whole numbers: half a pixel less than in "
    "the dataset.",
    "Boxes are x, y, width and height, these being the greatest pixel less the least, as bop_toolkit counts them; "
    "bbox_obj is the box of the whole silhouette, also outside the frame. Boxes of invisible bodies are -1 -1 -1 -1.",
    "bop_toolkit's OpenGL renderers count (cx, cy) from the first pixel's corner: give them cx + 0.5 and cy + 0.5. "
    "Its other programs read K unchanged.",
    "A scene is a variant in a split, and an image has the number of its place in the stage. mask is the silhouette "
    "without occlusion, mask_visib its visible part.",
    "Several cameras of a stage are in one scene: their folders and files end in _CAMERA, and cam_R_w2c and cam_t_w2c "
    "take the first one's axes to theirs.",
    "The diameter is the largest distance between two points of the model; no symmetries are given.",
    "models has the rendered meshes. bop_toolkit's evaluation reads models_eval: copy models to that name, or simplify "
    "its meshes there.",
)
FILE = "scene_gt.json"
SCALES = (0.1, 1.0)
"""Steps of depth, millimetres. Larger steps would be too coarse: BOP's tools decide visibility at 5 mm and 15 mm."""
WITHOUT_DEPTH = "export without depth: --option depth=no"


def depth_scale(dataset: ExportedDataset) -> float:
    """Return the finest of SCALES that holds the depth of all targets in all pictures; the last if none does, or if
    there are occluders, whose distance is unknown."""
    if any(part.target == OCCLUDER for part in dataset.dataset.parts.values()):
        return SCALES[-1]
    deepest = (dataset.farthest + reach(dataset.dataset.targets)) * MILLIMETRES
    return next((scale for scale in SCALES if deepest <= scale * UINT16_MAX), SCALES[-1])


def amodal_known(survey: Survey) -> None:
    """Raise UnsupportedError if a body can hide another, and pictures lack the label of hidden parts."""
    if survey.several and survey.kinds[AMODAL] < survey.tally.total():
        found = f"the dataset has several bodies, and {survey.format} has masks of each as if nothing else were there"
        raise UnsupportedError(found, do=f"render it with --labels default,{INSTANCE},{AMODAL}")


def _files(dataset: ExportedDataset, original: ExportedPicture) -> Iterator[Output]:
    picture = as_exported(dataset, original)
    scene, sensor = _scene(dataset, picture.split, picture.variant), _sensor(picture)
    colour = picture.picture.files["image"].channels > 1
    yield image_file(picture, f"{scene}/{'rgb' if colour else 'gray'}{sensor}")
    scale = depth_scale(dataset)
    if dataset.options[DEPTH] == YES:
        yield depth_file(picture, f"{scene}/depth{sensor}", scale)
    poses, seen = [], []
    for place, target in enumerate(picture.targets):
        visible, amodal = picture.mask(target.id), picture.amodal_mask(target.id)
        yield mask_file(picture, f"{scene}/mask{sensor}", place, amodal)
        yield mask_file(picture, f"{scene}/mask_visib{sensor}", place, visible)
        poses.append(pose_entry(target.id, target.q_cam_body, target.t_cam_body))
        outline = _outline(dataset, picture, target)
        fraction = target.visible_fraction
        seen.append(visibility_entry(visible=visible, amodal=amodal, fraction=fraction, outline=outline))
    camera = {"cam_K": camera_matrix(picture.camera, first_centre=FIRST_CENTRE), "depth_scale": scale}
    names = [f"{name}{sensor}" for name in INDEXES]
    yield from scene_rows(picture, scene, dict(zip(names, (camera | _placed(picture), poses, seen), strict=True)))
    if picture.split == SPLITS["test"]:
        yield from _asked_for(dataset, picture, seen)


def _asked_for(dataset: ExportedDataset, picture: ExportedPicture, seen: list[dict[str, Any]]) -> Iterator[Output]:
    """Yield the entries of the list of bodies whose poses a test requires."""
    place = {"im_id": image_number(picture), "scene_id": _scene_number(dataset, picture.variant)}
    for target, visibility in zip(picture.targets, seen, strict=True):
        if visibility["visib_fract"] >= SEEN:
            yield IndexRow(path=TARGETS, value={**place, "obj_id": target.id, "inst_count": 1})


def _outline(dataset: ExportedDataset, picture: ExportedPicture, target: PicturedTarget) -> Float:
    """Return pixels (N, 2), whose centres are at whole numbers and a half, of points around the target's silhouette."""
    hull = body_models(dataset)[target.id].hull
    points = hull @ target.T_cam_body[:3, :3].T + target.T_cam_body[:3, 3]
    return picture.camera.project(in_front(points))


def _scene(dataset: ExportedDataset, split: str, variant: str) -> str:
    return f"{split}/{_scene_number(dataset, variant):06d}"


def _scene_number(dataset: ExportedDataset, variant: str) -> int:
    """Return the number of the scene of the variant's augmentation, from 0: its cameras are in one scene."""
    scenes = dict.fromkeys(augmentation_and_camera(each)[0] for each in dataset.variants)
    return list(scenes).index(augmentation_and_camera(variant)[0])


def _sensor(picture: ExportedPicture) -> str:
    """Return BOP's suffix for the folders and files of one of several cameras."""
    rig = picture.picture.recorded.rig
    return "" if rig is UNSET else f"_{rig.camera}"


def _placed(picture: ExportedPicture) -> dict[str, Any]:
    """Return how one of several cameras stands, from the axes of the first, which are the world's here, to its own."""
    rig = picture.picture.recorded.rig
    if rig is UNSET:
        return {}
    turn = matrix_from_quaternion(rig.q_first_cam).T
    place = -turn @ np.array(rig.t_first_cam) * MILLIMETRES
    return {"cam_R_w2c": turn.ravel().tolist(), "cam_t_w2c": (place + 0.0).tolist()}


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    sensors = dict.fromkeys(_sensor(dataset.first(variant)) for variant in dataset.variants)
    names = [f"{name}{sensor}" for sensor in sensors for name in INDEXES]
    asked_for = {TARGETS: json_list()} if SPLITS["test"] in dataset.splits else {}
    return scene_indexes(dataset, _scene, names) | asked_for


def _shared(dataset: ExportedDataset) -> Iterator[ExportFile]:
    camera = dataset.cameras[0]
    shift = FIRST_CENTRE - 0.5
    said = {
        "width": camera.width,
        "height": camera.height,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx + shift,
        "cy": camera.cy + shift,
        "depth_scale": depth_scale(dataset),
    }
    yield MadeFile(path="camera.json", write=write_json_file(said))
    yield from model_files(dataset)


def _layout(options: Mapping[str, Any]) -> Layout:
    rectify, depth = options[RECTIFY] == YES, options[DEPTH] == YES
    return Layout(
        needs=("image", "segmentation", *(["depth"] if depth else [])),
        conventions=CONVENTIONS + (RECTIFIED if rectify else ()),
        files=_files,
        shared=_shared,
        indexes=_indexes,
        limits=(
            bodies_told_apart,
            amodal_known,
            *(() if rectify else (undistorted(RECTIFY_IT),)),
            *((depth_at_most(SCALES[-1], WITHOUT_DEPTH),) if depth else ()),
        ),
        splits=SPLITS,
        several=True,
        first_centre=FIRST_CENTRE,
    )


BOP = ExportFormat(
    name="bop",
    holds="scenes of images, depth, masks and poses, with models",
    layout=_layout,
    options=(
        RECTIFYING,
        FormatOption(name=DEPTH, meaning="whether depth is exported", default=YES, choices=(YES, "no")),
    ),
)


def read_poses(path: Path) -> Iterator[PoseEntry | str]:
    """Read the poses of the first body of each image. Raises InputError that names the image."""
    images = read_json_file(path, MAX_POSE_LIST)
    if not isinstance(images, dict):
        raise InputError("is not an object of images", where=path, do="give a scene_gt.json as BOP has it")
    scene = _scene_name(path)
    empty = [number for number, bodies in images.items() if bodies == []]
    several = [number for number, bodies in images.items() if isinstance(bodies, list) and len(bodies) > 1]
    if empty:
        yield f"left out {pluralise(len(empty), 'image')} without bodies, such as {empty[0]}"
    if several:
        ids = [_object(body) for body in images[several[0]]]
        bodies = f"{pluralise(len(several), 'image')}, such as {several[0]} with obj_id {', '.join(map(str, ids))}"
        rest = "write the poses of each other as CSV, and give it as --also MODEL:FILE"
        yield f"several bodies in {bodies}: the first of the least obj_id is taken; {rest}"
    for number in sorted(images, key=_number):
        if images[number] != []:
            yield _entry(images[number], f"{scene}_{_number(number):06d}", f"{path}, image {number}")


def _entry(bodies: Any, name: str, where: str) -> PoseEntry:
    if not isinstance(bodies, list) or not bodies or not all(isinstance(body, dict) for body in bodies):
        raise InputError("lists no bodies", where=where)
    body = min(bodies, key=_object)
    millimetres = finite_numbers(body.get("cam_t_m2c"), 3, "cam_t_m2c", where)
    rotation, off = quaternion_of(body.get("cam_R_m2c"), "cam_R_m2c", where)
    place = [value / MILLIMETRES for value in millimetres]
    return PoseEntry(filename=name, q_cam_body=rotation, t_cam_body=place, off_rotation=off)


def _object(body: Any) -> int:
    return _number(body.get("obj_id", 0) if isinstance(body, dict) else None)


def _scene_name(path: Path) -> str:
    """Return the name of the scene: its folder's; in SwissCube the name of the enclosing sequence, which has one
    scene."""
    folder = path.resolve().parent
    return folder.parent.name if folder.parent.name.startswith("seq_") else folder.name


def _number(text: Any) -> int:
    """Return the number of an image or a body. Raises InputError."""
    try:
        return int(text)
    except (TypeError, ValueError):
        raise InputError(f"{text!r} is not a number", where=FILE) from None


BOP_POSES = PoseFormat(
    name="BOP",
    recognises=lambda path, head: path.name == FILE or (head.lstrip().startswith("{") and '"cam_R_m2c"' in head),
    read=read_poses,
    lists=files_like(FILE, f"*/{FILE}", f"*/*/{FILE}", f"*/*/*/{FILE}"),
)


def read_camera(path: Path) -> Calibration:
    """Read BOP's camera.json at `path`. Raises InputError."""
    said = read_json_file(path, MAX_SPECIFICATION)
    if not isinstance(said, dict):
        raise InputError("holds no camera", where=path, do="give one JSON object with width, height, fx, fy, cx, cy")
    numbers = [said.get(name) for name in ("width", "height", "fx", "fy", "cx", "cy")]
    width, height, fx, fy, cx, cy = finite_numbers(numbers, 6, "width, height, fx, fy, cx or cy", str(path))
    size = whole([width, height], path)
    return Calibration(size=size, projection=(fx, fy, cx, cy), distortion=(0.0,) * 5)


BOP_CAMERA = CameraFormat(
    name="BOP",
    first_centre=FIRST_CENTRE,
    recognises=lambda path, head: all(f'"{name}"' in head for name in ("fx", "fy", "cx", "cy", "depth_scale")),
    read=read_camera,
)
