"""SPEED (2019): lists of poses, and grey images in a folder for each split.

It has no lens distortion. Sources: pedropro/UrsoNet (speed.py: SPLIT.json, images/SPLIT), tpark94/speedplusbaseline
(distortion taken as zero).
"""

from collections.abc import Iterator, Mapping

from spin_usd.exchange.layout.export_format import ExportFormat, IndexRow, Layout, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import GREY_JPEG, grey_image
from spin_usd.exchange.layout.index_file import IndexFile, json_list
from spin_usd.exchange.layout.limits import no_distortion, one_camera
from spin_usd.exchange.speedplus import POSE_CONVENTIONS, SPEED_QUATERNION, camera_file, pose_row

CONVENTIONS = (
    *POSE_CONVENTIONS,
    GREY_JPEG,
    "All lists have poses, test.json too. camera.json is not in the original, whose camera is f = 17.6 mm, pitch "
    "5.86 um.",
)


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {f"{split}.json": json_list() for split in dataset.splits}


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    filename = f"{picture.name}.jpg"
    yield grey_image(picture, f"images/{picture.split}/{filename}")
    yield IndexRow(path=f"{picture.split}.json", value=pose_row(picture, filename, SPEED_QUATERNION))


LAYOUT = Layout(
    needs=("image",),
    conventions=CONVENTIONS,
    shared=lambda dataset: iter((camera_file(dataset),)),
    indexes=_indexes,
    files=_files,
    limits=(no_distortion, one_camera),
    splits={"train": "train", "validation": "validation", "test": "test"},
)


SPEED = ExportFormat(name="speed", holds="in the layout of SPEED (2019): poses and grey images", layout=LAYOUT)
