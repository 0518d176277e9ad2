"""SHIRT: camera.json and metadata.json, then for a trajectory its list of poses and its images.

Source: the set's description (purl.stanford.edu/zq716br5462). Its labels are of the servicer's body, on which
metadata.json mounts the camera; here camera and servicer are one.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from spin_usd.exchange.layout.export_format import (
    ExportFile,
    ExportFormat,
    FormatOption,
    IndexRow,
    Layout,
    MadeFile,
    Output,
)
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import GREY_JPEG, grey_image
from spin_usd.exchange.layout.index_file import IndexFile, json_list, write_json_file
from spin_usd.exchange.layout.limits import no_fisheye, one_camera, one_variant
from spin_usd.exchange.speedplus import POSE_CONVENTIONS, camera_file, pose_row

STEP_S = 5.0
MOUNT = {"r_pri2cam_pri": [0.0, 0.0, 0.0], "q_pri2cam": [1.0, 0.0, 0.0, 0.0]}
CONVENTIONS = (
    *POSE_CONVENTIONS,
    "The list is one trajectory, in its order; metadata.json has its seconds a picture (cam_step) and the mount of "
    "the camera on the servicer (pMdl), here the identity: poses are of the camera.",
    GREY_JPEG,
)


def layout(options: Mapping[str, Any]) -> Layout:
    """Return the layout for the options "trajectory", "domain" and "step"."""
    return Layout(
        needs=("image",),
        conventions=CONVENTIONS,
        shared=_shared,
        indexes=_indexes,
        files=_files,
        limits=(no_fisheye, one_camera, one_variant),
        splits={"train": options["trajectory"]},
    )


def _shared(dataset: ExportedDataset) -> Iterator[ExportFile]:
    step = dataset.options["step"] or _step(dataset)
    metadata = {"pSim": {"cam_step": step, "num_images": len(dataset)}, "pMdl": MOUNT}
    yield camera_file(dataset)
    yield MadeFile(path="metadata.json", write=write_json_file(metadata))


def _step(dataset: ExportedDataset) -> float:
    """Return the seconds from the first picture to the second; SHIRT's own if pictures have no times."""
    times = [dataset.picture(number).picture.time_s for number in range(min(len(dataset), 2))]
    first, second = times if len(times) == 2 else (None, None)
    return STEP_S if first is None or second is None else second - first


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {_list(dataset): json_list()}


def _list(dataset: ExportedDataset) -> str:
    trajectory = dataset.options["trajectory"]
    return f"{trajectory}/{trajectory}.json"


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    filename = f"{picture.name}.jpg"
    yield grey_image(picture, f"{dataset.options['trajectory']}/{dataset.options['domain']}/images/{filename}")
    yield IndexRow(path=_list(dataset), value=pose_row(picture, filename))


SHIRT = ExportFormat(
    name="shirt",
    holds="in the layout of SHIRT: the poses of one trajectory, and grey images",
    layout=layout,
    options=(
        FormatOption(name="trajectory", meaning="its name", default="roe1", choices=("roe1", "roe2")),
        FormatOption(
            name="domain", meaning="the images' folder", default="synthetic", choices=("synthetic", "lightbox")
        ),
        FormatOption(
            name="step",
            meaning="seconds between pictures; the stage's, or 5, if not given",
            default="",
            read=lambda text: float(text) if text else None,
        ),
    ),
)
