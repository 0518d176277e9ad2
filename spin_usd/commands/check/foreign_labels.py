"""The labels that a data set of somebody else lacks, made from its poses, its camera and a model of its target."""

import csv
import shutil
from pathlib import Path

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedTarget
from spin_usd.audit.posed_targets import AuditedSet, usable
from spin_usd.commands.author.run import author
from spin_usd.commands.check.options import CheckOptions
from spin_usd.commands.render.run import render
from spin_usd.errors import InputError, OutputError
from spin_usd.exchange.cameras.speed_camera import camera_document
from spin_usd.exchange.layout.index_file import write_json_file
from spin_usd.formats.mesh.mesh_file import says_unit
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import quaternion_from_matrix

COLUMNS = ("name", "qw", "qx", "qy", "qz", "x", "y", "z", "image")


def write_labels(out: Path, audited: AuditedSet, options: CheckOptions) -> str:
    """Author a stage from the set's poses and `options.model`, render its labels alone, and return a sentence on them.

    The folder `out` gets the stage, the dataset, and poses.csv, whose columns name and image are a picture's name here
    and its image in the set. Raises InputError without poses, and for several targets or cameras; then there is no
    folder.
    """
    rows = [(picture.labels, target) for picture in audited.pictures for target, _ in picture.targets()]
    posed = [(picture, target) for picture, target in rows if usable(target) and picture.camera is not None]
    cameras = {picture.camera for picture, _ in posed if picture.camera is not None}
    ids = sorted({target.id for _, target in posed})
    if len(cameras) != 1 or len(ids) != 1:
        found = f"has {len(ids)} targets with poses and {len(cameras)} cameras, and labels are made of one of each"
        raise InputError(found, do="give --camera, or a folder with the pictures of one target")
    try:
        out.mkdir(parents=True)
    except OSError as error:
        raise OutputError(f"cannot be made ({error.strerror})", where=out, do="give a new folder") from None
    try:
        return _made(out, audited, posed, cameras.pop(), options)
    except BaseException:
        shutil.rmtree(out, ignore_errors=True)
        raise


def _made(
    out: Path,
    audited: AuditedSet,
    posed: list[tuple[AnnotatedPicture, AnnotatedTarget]],
    camera: Camera,
    options: CheckOptions,
) -> str:
    write_json_file(camera_document(camera))(out / "camera.json")
    _write_poses(out / "poses.csv", audited, posed)
    _author(out, options)
    pictures, stage = out / "dataset", out / "stage"
    made = render(stage, out=pictures, labels_only=True, on_progress=options.on_progress, on_note=options.on_note)
    return f"{pictures} has labels of {made.pictures} pictures; poses.csv has the image of each"


def _write_poses(path: Path, audited: AuditedSet, posed: list[tuple[AnnotatedPicture, AnnotatedTarget]]) -> None:
    targets = audited.posed[posed[0][1].id]
    names = _names([picture.name for picture, _ in posed])
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for (picture, _), name, R, t in zip(posed, names, targets.rotations(), targets.t, strict=True):
            table.writerow((name, *map(repr, quaternion_from_matrix(R).tolist()), *map(repr, t.tolist()), picture.name))


def _names(images: list[str]) -> list[str]:
    """Return names of pictures: of images without their folders, or with them where those repeat."""
    stems = [Path(image).stem for image in images]
    return stems if len(set(stems)) == len(stems) else [image.rpartition(".")[0].replace("/", "_") for image in images]


def _author(out: Path, options: CheckOptions) -> None:
    model = Path(str(options.model))
    unit = None if not model.is_file() or says_unit(model) else 1 / options.model_unit
    author(
        out=out / "stage",
        poses=out / "poses.csv",
        target=str(options.model),
        camera=str(out / "camera.json"),
        units_per_metre=unit,
        on_progress=options.on_progress,
    )
