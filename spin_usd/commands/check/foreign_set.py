"""`check` of a data set of somebody else, as it lies: read, measured in children, held to the rules."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget
from spin_usd.audit.list_rules import list_findings
from spin_usd.audit.picture_measures import (
    Lens,
    MeasurePictures,
    ModelFile,
    PictureFiles,
    PictureMeasures,
    TargetFiles,
    TraceOutlines,
)
from spin_usd.audit.pixel_rules import pixel_findings
from spin_usd.audit.pose_rules import pose_findings
from spin_usd.audit.posed_targets import AuditedPicture, AuditedSet, PosedTargets, usable
from spin_usd.audit.readings import MIRRORS, Outlines, Reading, readings
from spin_usd.audit.set_finding import SetFinding
from spin_usd.basics.arrays import Float
from spin_usd.basics.progress import Progress
from spin_usd.commands.check.calls import MEASURE_PICTURES, MODEL_POINTS, TRACE_OUTLINES
from spin_usd.commands.check.options import CheckOptions
from spin_usd.errors import InputError, SpinError
from spin_usd.exchange.read_camera import read_camera
from spin_usd.exchange.sets.set_format import SetFormat
from spin_usd.exchange.sets.table import read_set
from spin_usd.formats.mesh.mesh_file import READERS
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.processes.deaths import READING_TRIES
from spin_usd.processes.executor import done_in_order
from spin_usd.processes.processors import usable_cpus
from spin_usd.processes.task import Task

BATCH = 16  # pictures of a call
TRACED = 200  # pictures in which a model's outline is followed


@dataclass(frozen=True, kw_only=True)
class CheckedSet:
    """A data set of somebody else, and what is wrong with it."""

    audited: AuditedSet
    layout: SetFormat
    notes: Sequence[str]
    findings: Sequence[SetFinding]


def checked_set(root: Path, options: CheckOptions) -> CheckedSet:
    """Check the data set in the folder `root`. Raises InputError for a folder in no known layout."""
    found, layout, reasons = read_set(root, options.layout)
    notes = list(reasons)
    if not found.pictures:
        raise InputError(
            f"holds no labelled picture as {layout.name}", where=root, do="check the path, or give --layout"
        )
    labels = _with_camera(found, options, notes)
    models = _models(root, labels, options)
    points = _all_points(models, options, notes)
    measures = _measures(root, labels, models, options) if not options.without_pixels else []
    pictures = [
        AuditedPicture(labels=picture, measures=measures[place] if place < len(measures) else None)
        for place, picture in enumerate(labels.pictures)
    ]
    audited = AuditedSet(labels=labels, pictures=pictures)
    outlines = {} if options.without_pixels else _outlines(root, audited, models, options)
    findings = [*list_findings(audited), *pixel_findings(audited), *pose_findings(audited, points, outlines)]
    return CheckedSet(audited=audited, layout=layout, notes=notes, findings=findings)


def _with_camera(found: AnnotatedSet, options: CheckOptions, notes: list[str]) -> AnnotatedSet:
    """Return the set with the camera of --camera, if given, in all pictures; add a note where there is none."""
    lacking = sum(picture.camera is None for picture in found.pictures)
    posed = any(usable(target) for picture in found.pictures for target in picture.targets)
    if options.camera is not None:
        camera = read_camera(options.camera).camera
        return replace(found, pictures=[replace(each, camera=camera) for each in found.pictures])
    if lacking and posed:
        notes.append(
            f"{lacking} of {len(found.pictures)} pictures have no camera: give --camera to compare their poses"
        )
    return found


def _models(root: Path, labels: AnnotatedSet, options: CheckOptions) -> dict[str, tuple[str, float]]:
    """Return the path and the unit of each model, by id; "" for all others."""
    own = {key: (str(root / name), labels.model_unit) for key, name in labels.models.items()}
    given = Path(options.model) if options.model is not None else None
    if given is None or (options.labels_to and given.suffix.lower() not in READERS):
        return own
    return own | {"": (str(given), options.model_unit)}


def _all_points(models: dict[str, tuple[str, float]], options: CheckOptions, notes: list[str]) -> dict[str, Float]:
    """Return the points (M, 3) of each model's hull, metres, and leave out those of the set that cannot be read, with a
    note. Raises the error of the user's own."""
    found = {}
    for key, (path, unit) in list(models.items()):
        request = ModelFile(path=path, unit=unit)
        (task,) = done_in_order([Task(call=MODEL_POINTS, request=request, tries=READING_TRIES)], 1)
        if isinstance(task.failure, SpinError):
            if path == str(options.model):
                raise task.failure
            notes.append(f"{path} {task.failure.found}: nothing is compared with this model")
            del models[key]
        else:
            found[key] = np.array(task.result, np.float64)
    return found


def _measures(
    root: Path, labels: AnnotatedSet, models: Mapping[str, tuple[str, float]], options: CheckOptions
) -> list[PictureMeasures]:
    """Return what the files of each picture measure; a picture that kills its child has an error."""
    files = [picture_files(labels, picture) for picture in labels.pictures]
    batches = [files[start : start + BATCH] for start in range(0, len(files), BATCH)]
    tasks = [
        Task(call=MEASURE_PICTURES, request=_request(root, labels, models, each), tries=READING_TRIES)
        for each in batches
    ]
    found: list[PictureMeasures] = []
    progress: Progress = options.progress
    progress("measuring: picture", 0, len(files))
    for batch, task in zip(batches, done_in_order(tasks, min(len(tasks), len(usable_cpus()))), strict=True):
        found += _singly(root, labels, models, batch) if isinstance(task.failure, SpinError) else task.result
        progress("measuring: picture", len(found), len(files))
    return found


def _outlines(
    root: Path, audited: AuditedSet, models: Mapping[str, tuple[str, float]], options: CheckOptions
) -> dict[str, Outlines]:
    """Return how models follow edges in pictures of targets that have neither masks nor boxes, by id."""
    found = {}
    for key, targets in audited.posed.items():
        model = models.get(key, models.get(""))
        if model is None or not targets.unlabelled.all():
            continue
        some = targets.some(TRACED)
        poses = np.stack([_matrices(each, some) for each in readings(some) if not each.mirrored], 1)
        files = [picture_files(audited.labels, picture.labels) for picture, *_ in some.rows]
        tasks = [
            Task(
                call=TRACE_OUTLINES,
                request=TraceOutlines(
                    folder=str(root), pictures=files[at : at + 1], poses=poses[at : at + 1].tolist(), model=model
                ),
                tries=READING_TRIES,
            )
            for at in range(len(files))
        ]
        scores = []
        for done, task in enumerate(done_in_order(tasks, min(len(tasks), len(usable_cpus())))):
            options.progress("following outlines: picture", done, len(tasks))
            scores += [[np.nan] * poses.shape[1] * len(MIRRORS)] if isinstance(task.failure, SpinError) else task.result
        found[key] = Outlines(targets=some, scores=np.array(scores))
    return found


def _matrices(reading: Reading, targets: PosedTargets) -> Float:
    """Return T_cam_body (N, 3, 4) in that reading."""
    R, t = reading.poses(targets)
    return np.concatenate([R, t[:, :, None]], 2)


def _singly(
    root: Path, labels: AnnotatedSet, models: Mapping[str, tuple[str, float]], batch: Sequence[PictureFiles]
) -> Iterator[PictureMeasures]:
    """Yield the measures of pictures of which one kills its child, each in a call of its own."""
    requests = [_request(root, labels, models, [each]) for each in batch]
    tasks = [Task(call=MEASURE_PICTURES, request=each, tries=READING_TRIES) for each in requests]
    for picture, task in zip(batch, done_in_order(tasks, 1), strict=True):
        if isinstance(task.failure, SpinError):
            yield PictureMeasures(name=picture.name, errors={picture.name: task.failure.found})
        else:
            yield from task.result


def _request(
    root: Path, labels: AnnotatedSet, models: Mapping[str, tuple[str, float]], pictures: Sequence[PictureFiles]
) -> MeasurePictures:
    return MeasurePictures(
        folder=str(root), pictures=list(pictures), models=dict(models), lossy_masks=labels.masks_are_lossy
    )


def picture_files(labels: AnnotatedSet, picture: AnnotatedPicture) -> PictureFiles:
    """Return the files of a picture, and its labels that are compared with them."""
    targets = [
        TargetFiles(
            id=target.id,
            mask=target.mask,
            box=target.box.tolist() if target.box is not None else None,
            pose=_pose(labels, target),
        )
        for target in picture.targets
    ]
    lens = _lens(picture.camera) if picture.camera else None
    return PictureFiles(name=picture.name if picture.exists else "", targets=targets, depth=picture.depth, lens=lens)


def _pose(labels: AnnotatedSet, target: AnnotatedTarget) -> list[list[float]] | None:
    """Return T_cam_body (3, 4) of a usable target."""
    rotation, place = target.rotation, target.t_cam_body
    if not usable(target) or rotation is None or place is None:
        return None
    if rotation.shape == (4,):
        q = labels.q_cam_body(rotation[None])
        rotation = matrices_from_quaternions(q / np.linalg.norm(q))[0]
    pose: list[list[float]] = np.column_stack([rotation, place]).tolist()
    return pose


def _lens(camera: Camera) -> Lens:
    return Lens(
        size=(camera.width, camera.height),
        projection=(camera.fx, camera.fy, camera.cx, camera.cy),
        distortion=list(camera.distortion),
        fisheye=camera.fisheye,
    )
