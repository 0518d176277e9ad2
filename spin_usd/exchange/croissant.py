"""Croissant: the dataset's own images and labels, a table of all pictures, and croissant.json, which describes both.

The table is CSV with q_cam_body, scalar first, and t_cam_body in metres, and is joined with the images by their names.
Source: Croissant Format Specification 1.0, MLCommons (JSON-LD).
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from spin_usd.exchange.layout.export_format import ExportFormat, IndexRow, Layout, LinkedFile, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.index_file import IndexFile, csv_table, write_json_file
from spin_usd.exchange.layout.limits import no_fisheye, same_files
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows
from spin_usd.files.sha256 import sha256_of

TABLE, METADATA = "records.csv", "croissant.json"
IMAGE = "image"
MEDIA_TYPES = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".exr": "image/x-exr",
    ".npz": "application/zip",
    ".ply": "application/x-ply",
}
"""The media type of each kind of file by the ending of its name: of images and of all labels."""
TEXTS = {
    "name": "the picture's name in this export",
    "split": "the split that it is in",
    "variant": "the variant of the dataset that it is of",
    "frame": "its name in the dataset, the same in all variants",
}
NUMBERS = {
    "q_w": "q_cam_body, scalar: rotation from the target's axes to the camera's, unit quaternion, Hamilton",
    "q_x": "q_cam_body, x",
    "q_y": "q_cam_body, y",
    "q_z": "q_cam_body, z",
    "t_x": "t_cam_body, x: the target's origin in the camera's axes (x right, y down, z forward), metres",
    "t_y": "t_cam_body, y, metres",
    "t_z": "t_cam_body, z, metres",
    "width": "of the image, pixels",
    "height": "of the image, pixels",
    "fx": "focal length, pixels",
    "fy": "focal length, pixels",
    "cx": "principal point, pixels; (0, 0) is the corner of the image",
    "cy": "principal point, pixels",
    "k1": "lens distortion, OpenCV's formula",
    "k2": "lens distortion",
    "p1": "lens distortion",
    "p2": "lens distortion",
    "k3": "lens distortion",
}
# The context from the specification's appendix 1, by the terms that map to others of their own name.
_OWN = (
    "citeAs column extract field fileObject fileProperty fileSet format includes isLiveDataset jsonPath key md5 "
    "parentField path recordSet references regex repeated replace samplingRate separator source subField transform"
)
CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "sc": "https://schema.org/",
    **{term: f"cr:{term}" for term in _OWN.split()},
}
CONVENTIONS = (
    f"{METADATA} is JSON-LD by Croissant 1.0; licence, creator, citation and address are its owner's to add.",
    f"{TABLE} has a row a picture; {METADATA} describes each column.",
    "p_cam = R(q) p_body + t: the quaternion is scalar first, Hamilton; metres. Camera axes are OpenCV's: x right, y "
    "down, z forward. Body axes are the axes of the target's model. Numbers have all their digits.",
    "Images and labels are the dataset's own files.",
)
QUATERNION = ("q_w", "q_x", "q_y", "q_z")
POSITION = ("t_x", "t_y", "t_z")
HEAD = ",".join((*TEXTS, *QUATERNION, *POSITION))


def kinds_of(dataset: ExportedDataset) -> Mapping[str, str]:
    """Return the kinds of file that the first picture has, with the endings of their names."""
    return {kind: Path(file.path).suffix for kind, file in dataset.picture(0).picture.files.items()}


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {TABLE: csv_table((*TEXTS, *NUMBERS, *kinds_of(dataset)))}


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    names = []
    for kind, suffix in kinds_of(dataset).items():
        names.append(f"{picture.name}{suffix}")
        yield LinkedFile(path=f"{kind}/{names[-1]}", source=picture.file(kind))
    camera, target, entry = picture.camera, picture.target, dataset.entries[picture.number]
    numbers = (*target.q_cam_body.tolist(), *target.t_cam_body.tolist(), camera.width, camera.height)
    lens = (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)
    row = (picture.name, picture.split, entry.variant, entry.frame, *numbers, *lens, *names)
    yield IndexRow(path=TABLE, value=row)


def _image_of(dataset: ExportedDataset, picture: ExportedPicture) -> str:
    return f"{IMAGE}/{picture.name}{kinds_of(dataset)[IMAGE]}"


def _last(dataset: ExportedDataset, out: Path) -> Iterator[MadeFile]:
    yield MadeFile(path=METADATA, write=write_json_file(metadata(dataset, sha256_of(out / TABLE))))


def metadata(dataset: ExportedDataset, digest: str) -> dict[str, Any]:
    """Return croissant.json; `digest` is the sha256 of the table."""
    kinds = kinds_of(dataset)
    table = {
        "@type": "cr:FileObject",
        "@id": TABLE,
        "name": TABLE,
        "contentUrl": TABLE,
        "encodingFormat": "text/csv",
        "sha256": digest,
    }
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "name": dataset.target,
        "description": f"{len(dataset)} synthetic pictures of the spacecraft {dataset.target} with poses and labels.",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "distribution": [table, *(_file_set(kind, suffix) for kind, suffix in kinds.items())],
        "recordSet": [{"@type": "cr:RecordSet", "@id": "pictures", "name": "pictures", "field": list(_fields(kinds))}],
    }


def _file_set(kind: str, suffix: str) -> dict[str, Any]:
    return {
        "@type": "cr:FileSet",
        "@id": f"{kind}-files",
        "name": f"{kind}-files",
        "encodingFormat": MEDIA_TYPES[suffix],
        "includes": f"{kind}/*{suffix}",
    }


def _fields(kinds: Mapping[str, str]) -> Iterator[dict[str, Any]]:
    """Yield the columns of the table, and the content of the images, joined by the name of their file."""
    for name, meaning in TEXTS.items():
        yield _column(name, meaning, "sc:Text")
    for name, meaning in NUMBERS.items():
        yield _column(name, meaning, "sc:Integer" if name in ("width", "height") else "sc:Float")
    for kind in kinds:
        column = _column(kind, f"the name of its file in {kind}/", "sc:Text")
        joined = {"fileSet": {"@id": f"{kind}-files"}, "extract": {"fileProperty": "filename"}}
        yield column | ({"references": joined} if kind == IMAGE else {})
    source = {"fileSet": {"@id": f"{IMAGE}-files"}, "extract": {"fileProperty": "content"}}
    yield _field("image_content", "the image itself", "sc:ImageObject", source)


def _column(name: str, meaning: str, data_type: str) -> dict[str, Any]:
    return _field(name, meaning, data_type, {"fileObject": {"@id": TABLE}, "extract": {"column": name}})


def _field(name: str, meaning: str, data_type: str, source: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "@type": "cr:Field",
        "@id": f"pictures/{name}",
        "name": name,
        "description": meaning,
        "dataType": data_type,
        "source": source,
    }


LAYOUT = Layout(
    needs=(IMAGE,),
    conventions=CONVENTIONS,
    indexes=_indexes,
    files=_files,
    file=_image_of,
    last=_last,
    limits=(no_fisheye, same_files),
)


CROISSANT = ExportFormat(
    name="croissant", holds="unchanged, with Croissant metadata (MLCommons, JSON-LD)", layout=LAYOUT
)


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the rows of the table. Raises InputError that names the row."""
    for line, where, row in csv_rows(path):
        q, t = cells(row, QUATERNION, where), cells(row, POSITION, where)
        yield PoseEntry(filename=row["name"], q_cam_body=q, t_cam_body=t, line=line)


CROISSANT_POSES = PoseFormat(
    name="Croissant",
    recognises=lambda path, head: head.startswith(HEAD),
    read=read_poses,
    lists=files_like("*.csv"),
)
