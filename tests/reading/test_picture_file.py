import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.formats.array_file import encoded_array
from spin_usd.labels.table import LABELS
from spin_usd.reading.picture_file import read_picture_file
from spin_usd.scene.channels import Channels

FLOATS = Channels(meaning="", dtype="float32", holds={"Y": "z"})
POINTS = LABELS["lidar"].channels
CLOUD = np.zeros(3, [("points", "<f4", (3,)), ("ranges", "<f4")])


@pytest.mark.parametrize(
    ("kind", "file", "array"),
    [
        ("depth", "a.exr", np.zeros((4, 5, 3), np.float32)),
        ("depth", "a.png", np.zeros((4, 5), np.uint16)),
        ("depth", "a.npz", CLOUD),
        ("lidar", "a.npz", CLOUD),
        ("lidar", "a.exr", np.zeros((4, 5), np.float32)),
        ("image", "a.npz", CLOUD),
        ("image", "a.exr", np.zeros((4, 5, 3), np.float32)),
    ],
)
def test_numbers_of_another_kind_than_the_labels_are_refused(tmp_path, kind, file, array) -> None:
    """Whatever the record says of a label."""
    channels = [f"{i}" for i in range(array.shape[2] if array.ndim == 3 else 1)]
    written = Channels(meaning="", dtype="float32", holds=dict.fromkeys(channels, ""))
    (tmp_path / file).write_bytes(encoded_array(array, (tmp_path / file).suffix, kind=kind, channels=written))
    with pytest.raises(InputError, match=rf"{file}: holds .* not those of {kind}"):
        read_picture_file(FileIn(Folder(tmp_path), file), kind, "float32", 1)


def test_what_is_no_label_is_an_image_as_its_record_says(tmp_path) -> None:
    (tmp_path / "a.exr").write_bytes(encoded_array(np.ones((4, 5), np.float32), ".exr", kind="other", channels=FLOATS))
    assert read_picture_file(FileIn(Folder(tmp_path), "a.exr"), "other", "float32", 1).shape == (4, 5)


def test_columns_are_numbers_and_positions_three(tmp_path) -> None:
    np.savez(tmp_path / "a.npz", points=np.zeros((3, 2), np.float32), ranges=np.zeros(3, np.float32))
    with pytest.raises(InputError, match="its columns have other shapes"):
        read_picture_file(FileIn(Folder(tmp_path), "a.npz"), "lidar", POINTS.dtype, len(POINTS.holds))
