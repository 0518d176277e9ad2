"""nerfstudio: OpenCV, with the axes turned back, finds each surface point in the pixel that shows it."""

import json

import cv2
import numpy as np
import pytest
from plyfile import PlyData
from scipy.spatial import KDTree

from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.formats.image_file import read_image
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import PLAIN, clone, write_export

FLOAT32_PIXELS = 1e-3  # of a surface point in float32, seen from some metres
FLOAT32 = 1e-6  # metres, of a point of the target


@pytest.fixture(scope="module")
def nerfstudio(rendered, tmp_path_factory):
    out = tmp_path_factory.mktemp("nerfstudio") / "out"
    write_export(rendered, "nerfstudio", out)
    return out, json.loads((out / "transforms.json").read_text())


def pictures(dataset, document):
    """Each frame, and the picture that it is of."""
    for frame in document["frames"]:
        yield frame, Dataset(dataset).picture(frame["file_path"].removeprefix("images/").removesuffix(".png"))


def test_opencv_finds_surface_points_in_their_pixels(nerfstudio, rendered) -> None:
    _, document = nerfstudio
    K = np.array([[document["fl_x"], 0, document["cx"]], [0, document["fl_y"], document["cy"]], [0, 0, 1]])
    lens = np.array([document[name] for name in ("k1", "k2", "p1", "p2", "k3")])
    for frame, picture in pictures(rendered, document):
        rows, columns = np.nonzero(picture.mask(1))
        body = np.c_[picture.dense_pose[rows, columns].astype(float), np.ones(len(rows))]
        right, up, backward, _ = np.linalg.inv(frame["transform_matrix"]) @ body.T
        seen = cv2.projectPoints(np.c_[right, -up, -backward], np.zeros(3), np.zeros(3), K, lens)[0][:, 0]
        np.testing.assert_allclose(seen, np.c_[columns, rows] + 0.5, rtol=0, atol=FLOAT32_PIXELS)


def test_masks_and_depth_are_the_labels(nerfstudio, rendered) -> None:
    out, document = nerfstudio
    for frame, picture in pictures(rendered, document):
        np.testing.assert_array_equal(read_image(out / frame["mask_path"])[0], np.where(picture.mask(1), 255, 0))
        depth = read_image(out / frame["depth_file_path"])[0] * document["depth_unit_scale_factor"]
        np.testing.assert_allclose(depth, picture.depth, atol=0.501e-3)


@pytest.mark.parametrize("to", ["nerfstudio", "colmap"])
def test_grey_images_have_three_equal_channels_on_request(rendered, tmp_path, to) -> None:
    assert write_export(rendered, to, tmp_path / "out", options={"rgb": "yes"}).notes == ()
    for file, picture in zip(sorted((tmp_path / "out" / "images").iterdir()), Dataset(rendered), strict=True):
        np.testing.assert_array_equal(read_image(file)[0], np.repeat(picture.image[..., None], 3, -1))


@pytest.mark.parametrize("to", ["nerfstudio", "colmap"])
def test_grey_images_are_told_to_trainers_of_splats(rendered, tmp_path, to) -> None:
    (note,) = write_export(rendered, to, tmp_path / "out").notes
    assert "3 images in grey" in note
    assert "--option rgb=yes" in note
    assert write_export(rendered, "coco", tmp_path / "coco").notes == ()


def test_points_are_the_surfaces_that_pictures_show(nerfstudio, rendered) -> None:
    out, document = nerfstudio
    cloud = PlyData.read(out / document["ply_file_path"])["vertex"]
    points = np.stack([cloud[name] for name in "xyz"], -1)
    assert len(points) > 1000
    shown, colours = [], []
    for picture in Dataset(rendered):
        shown.append(picture.dense_pose[picture.mask(1)])
        colours.append(picture.image[picture.mask(1)])
    distances, nearest = KDTree(np.concatenate(shown)).query(points)
    assert distances.max() < FLOAT32
    for name in ("red", "green", "blue"):
        np.testing.assert_array_equal(cloud[name], np.concatenate(colours)[nearest])


def test_cameras_that_differ_stand_in_each_frame(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a"}, {"frame": "b", "camera": PLAIN}])
    write_export(dataset, "nerfstudio", tmp_path / "out")
    document = json.loads((tmp_path / "out" / "transforms.json").read_text())
    assert "fl_x" not in document
    assert [frame["fl_x"] for frame in document["frames"]] == [
        Dataset(dataset).picture(name).camera.fx for name in "ab"
    ]
    assert document["frames"][1]["k1"] == 0


@pytest.mark.parametrize(
    ("split", "counts"),
    [
        ("train=0.5,validation=0.5", {"train": 3, "val": 3, "test": 3}),
        ("train=0.5,validation=0.34,test=0.16", {"train": 3, "val": 2, "test": 1}),
        ("train=1", {}),
    ],
)
def test_splits_are_lists_of_files_all_three_or_none(two_variants, tmp_path, split, counts) -> None:
    write_export(two_variants, "nerfstudio", tmp_path / "out", split=split, variants=("nominal",))
    document = json.loads((tmp_path / "out" / "transforms.json").read_text())
    found = {name.removesuffix("_filenames"): files for name, files in document.items() if name.endswith("_filenames")}
    assert {name: len(files) for name, files in found.items()} == counts
    assert {each for files in found.values() for each in files} <= {each["file_path"] for each in document["frames"]}


def test_depth_beyond_sixteen_bits_is_refused_and_can_be_left_out(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a", "t": [0, 0, 65]}])
    with pytest.raises(UnsupportedError, match=r"16 bits of 1 mm end at 65.535 m; export without depth: --option"):
        write_export(dataset, "nerfstudio", tmp_path / "out")
    write_export(dataset, "nerfstudio", tmp_path / "out", options={"depth": "no"})
    assert "depth_file_path" not in (tmp_path / "out" / "transforms.json").read_text()


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ([], r"has no list of frames; give a transforms\.json"),
        ({"frames": [{}]}, r"frame 0: has no file_path"),
        ({"frames": [{"file_path": "a", "transform_matrix": [[1]]}]}, "frame 0: transform_matrix is not a list of 4"),
        ({"frames": [{"file_path": "a", "transform_matrix": 3 * [[1, 0, 0]]}]}, "a row of transform_matrix is not"),
        ({"frames": [{"file_path": "a", "transform_matrix": 4 * [[1, 0, 0, 0]]}]}, "is not a rotation"),
        ({"frames": []}, "holds no poses"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path, document, words) -> None:
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=words):
        read_pose_list(tmp_path / "transforms.json")
