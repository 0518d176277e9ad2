"""Poses of trajectories as CSV, a sequence for each variant: SPARK's stream 2, and CubeSat-CDT.

Source: the SPARK 2022 and 2024 challenges: filename,sequence,Tx,Ty,Tz,Qx,Qy,Qz,Qw and SPLIT/images/GTnnn.
"""

from collections.abc import Iterator, Mapping

from spin_usd.exchange.layout.exported_dataset import ExportedDataset
from spin_usd.exchange.layout.exported_picture import ExportedPicture
from spin_usd.exchange.layout.images import any_image
from spin_usd.exchange.layout.index_file import IndexFile, csv_table
from spin_usd.exchange.layout.layout import Layout
from spin_usd.exchange.layout.limits import no_distortion, one_camera
from spin_usd.exchange.layout.output import IndexRow, Output

COLUMNS = ("filename", "sequence", "Tx", "Ty", "Tz", "Qx", "Qy", "Qz", "Qw")
CONVENTIONS = (
    "p_cam = R(q) p_body + T: Qx, Qy, Qz, Qw is the unit quaternion, scalar last, Hamilton, of the rotation from the "
    "body's axes to the camera's; T is the body's origin in the camera's axes, in metres. Numbers have all "
    "their digits.",
    "Camera axes are OpenCV's: x right, y down, z forward. Body axes are those of the target's model.",
    "A sequence GTnnn is one variant of the dataset, in the order of its frames. Images are PNG, as the dataset's.",
    "The format has no camera file: K is that of the table below.",
)


def pose_table_layout(*, notes: tuple[str, ...] = ()) -> Layout:
    """Return the layout; `notes` are further sentences for the card."""
    return Layout(
        needs=("image",),
        conventions=(*CONVENTIONS, *notes),
        indexes=_indexes,
        files=_files,
        limits=(no_distortion, one_camera),
        splits={"train": "train", "validation": "val", "test": "test"},
    )


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {f"{split}.csv": csv_table(COLUMNS) for split in dataset.splits}


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    sequence = f"GT{dataset.variants.index(picture.variant) + 1:03}"
    filename = f"{picture.name}.png"
    yield any_image(picture, f"{picture.split}/images/{sequence}/{filename}")
    w, x, y, z = picture.target.q_cam_body.tolist()
    row = (filename, sequence, *picture.target.t_cam_body.tolist(), x, y, z, w)
    yield IndexRow(path=f"{picture.split}.csv", value=row)
