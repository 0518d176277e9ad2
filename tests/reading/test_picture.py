"""A picture as users read it agrees with OpenCV's readers, OpenCV's camera and SciPy's rotations."""

import json
import shutil

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.errors import InputError
from spin_usd.reading.dataset import Dataset

HALF_PIXEL_TOLERANCE = 1e-3  # pixels: float32 body points at SPEED+'s distances are off by less
SHAPE = (150, 240)


@pytest.fixture(scope="module")
def dataset(rendered):
    return Dataset(rendered)


@pytest.fixture
def copy(dataset, tmp_path):
    """The dataset, to be damaged."""
    return Dataset(shutil.copytree(dataset.root, tmp_path / "copy"))


def change(dataset, **changes) -> None:
    """Give the first picture's record other values."""
    frame, variant = dataset.names[0]
    path = dataset.root / "records" / variant / f"{frame}.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def projected(picture, points_body):
    """Pixels of body points (N, 3), by OpenCV."""
    rotation, _ = cv2.Rodrigues(picture.T_cam_body[:3, :3])
    return cv2.projectPoints(points_body, rotation, picture.t_cam_body, picture.camera_matrix, picture.distortion)[0][:, 0]  # fmt: skip  # noqa: E501


def test_opencv_projects_the_dense_pose_to_the_pixels_centres(dataset) -> None:
    picture = dataset[0]
    rows, columns = np.nonzero(picture.segmentation)
    assert len(rows) > 1000
    pixels = projected(picture, picture.dense_pose[rows, columns].astype(np.float64))
    assert np.abs(pixels - np.stack([columns + 0.5, rows + 0.5], -1)).max() < HALF_PIXEL_TOLERANCE


def test_opencv_projects_the_keypoints_to_theirs(dataset) -> None:
    picture = dataset[0]
    assert len(picture.keypoints.names) == len(picture.keypoint_pixels) > 5
    assert np.abs(projected(picture, picture.keypoints.points) - picture.keypoint_pixels).max() < 1e-9


def test_the_only_target_has_the_pose_of_the_picture(dataset) -> None:
    picture, (described,) = dataset[0], dataset.targets
    (shown,) = picture.targets
    assert (described.id, described.name) == (shown.id, shown.name) == (1, dataset.target)
    assert np.array_equal(shown.T_cam_body, picture.T_cam_body)
    assert shown.range == pytest.approx(np.linalg.norm(picture.t_cam_body), rel=1e-15)
    assert np.array_equal(picture.mask(1), picture.segmentation > 0)
    assert {part.target for part in dataset.parts.values()} == {1}
    with pytest.raises(InputError, match="there is no target 2; choose among 1 'tango'"):
        picture.mask(2)


def test_a_target_is_where_its_labels_show_it(dataset) -> None:
    picture = dataset[0]
    (shown,), (rows, columns) = picture.targets, np.nonzero(picture.mask(1))
    assert shown.box_visible.tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
    assert shown.pixels_visible == shown.pixels_amodal == len(rows)
    assert np.allclose(shown.box_amodal, shown.box_visible, atol=1)
    assert (shown.truncated, shown.visible_fraction) == (False, 1)
    assert np.allclose(shown.keypoints, picture.keypoint_pixels, rtol=0, atol=1e-9)
    assert len(shown.keypoint_states) == len(picture.keypoints.names)
    assert {"visible", "self-occluded"} == set(shown.keypoint_states)
    assert np.array_equal(shown.box, dataset.targets[0].box)
    assert shown.box_3d.shape == (8, 2)


def test_what_there_is_not_is_nan(copy) -> None:
    nothing = {"box": {"visible": None, "amodal": None, "truncated": True}, "visible_fraction": None}
    unseen = {"box_3d": {"box": [[0, 0, 0], [1, 1, 1]], "corners": [None] * 8}, "keypoints": [[None, None, "behind"]]}
    change(copy, targets=[copy[0].record["targets"][0] | nothing | unseen])
    (shown,) = copy[0].targets
    for name in ("box_visible", "box_amodal", "visible_fraction", "box_3d", "keypoints"):
        assert np.isnan(getattr(shown, name)).all(), name
    assert shown.keypoint_states == ("behind",)


def test_the_dense_pose_lies_in_the_box_of_its_target(dataset) -> None:
    (described,), picture = dataset.targets, dataset[0]
    points = picture.dense_pose[picture.mask(1)]
    low, high = described.box
    assert (points >= low - 1e-6).all()
    assert (points <= high + 1e-6).all()
    assert np.array_equal(described.size, high - low)


def test_quaternion_translation_and_matrix_are_one_pose(dataset) -> None:
    picture = dataset[0]
    rotation = Rotation.from_quat(picture.q_cam_body, scalar_first=True).as_matrix()
    assert np.allclose(picture.T_cam_body[:3, :3], rotation, atol=1e-12)
    assert np.array_equal(picture.T_cam_body[:3, 3], picture.t_cam_body)
    assert np.array_equal(picture.T_cam_body[3], [0, 0, 0, 1])


def test_depth_is_the_z_of_the_dense_pose_in_camera_axes(dataset) -> None:
    picture = dataset[0]
    seen = picture.segmentation > 0
    z = picture.dense_pose[seen] @ picture.T_cam_body[2, :3] + picture.T_cam_body[2, 3]
    assert np.allclose(picture.depth[seen], z, rtol=1e-5)
    assert not picture.depth[~seen].any()


def test_arrays_are_what_opencv_reads(dataset) -> None:
    picture = dataset[0]
    for kind in ("image", "segmentation"):
        file = dataset.root / picture.files[kind].path
        assert np.array_equal(picture.label(kind), cv2.imread(str(file), cv2.IMREAD_UNCHANGED))
    assert picture.image.shape == picture.depth.shape == picture.segmentation.shape == SHAPE
    assert picture.dense_pose.shape == (*SHAPE, 3)
    assert (picture.image.dtype, picture.segmentation.dtype, picture.dense_pose.dtype) == ("uint8", "uint16", "float32")
    assert picture.label("radiance").shape == (*SHAPE, 4)


def test_segmentation_ids_are_parts(dataset) -> None:
    picture = dataset[0]
    ids = set(np.unique(picture.segmentation)) - {0}
    assert len(ids) > 3
    assert ids <= picture.parts.keys()
    assert all(part.path.endswith(part.name) for part in picture.parts.values())


def test_arrays_are_read_once_and_are_the_callers(dataset) -> None:
    picture = dataset[0]
    picture.depth[0, 0] = 7
    assert picture.depth[0, 0] == 7
    assert dataset[0].depth[0, 0] == 0


@pytest.mark.parametrize("kind", ["image", "segmentation", "depth", "dense_pose"])
def test_rows_of_a_label_are_those_of_all_of_it(dataset, kind) -> None:
    rows = range(37, 90)
    np.testing.assert_array_equal(dataset[0].label(kind, rows=rows), dataset[0].label(kind)[37:90])
    with pytest.raises(InputError, match="its camera is not"):
        dataset[0].label(kind, rows=range(100, 100 + dataset[0].camera.height))


def test_a_label_that_is_not_there_is_refused_with_those_that_are(dataset) -> None:
    with pytest.raises(InputError, match=r"has no flow; choose among depth, .* or render flow too"):
        dataset[0].label("flow")


@pytest.mark.parametrize(
    "changes",
    [
        {"pose": {"q_cam_body": [1, 1, 1, 1], "t_cam_body": [0, 0, 1]}},
        {"pose": {"q_cam_body": [1, 0, 0, 0]}},
        {"camera": {"width": 240}},
        {"files": []},
        {"files": {"depth": {}}},
        {"files": {"depth": {"path": "depth/nominal/img000001.exr", "dtype": "float32"}}},
        {"camera": None},
    ],
    ids=lambda changes: json.dumps(changes)[:40],
)
def test_a_broken_record_is_refused_by_name(copy, changes) -> None:
    change(copy, **changes)
    with pytest.raises(
        InputError, match=r"img000001.json: (is not a record|breaks schema record-1 at \$\.).*; run spin-usd check"
    ):
        copy[0]


@pytest.mark.parametrize("targets", [[{}], [{"pose": 1}], [], 7])
def test_targets_of_a_broken_record_are_refused_by_name(copy, targets) -> None:
    change(copy, targets=targets)
    with pytest.raises(
        InputError, match=r"nominal/img000001.json: breaks schema record-1 at \$.targets.*; run spin-usd"
    ):
        copy[0]


@pytest.mark.parametrize(
    ("other", "said"),
    [([{"name": "other"}], "1 'other'"), ([{"id": 2}], "2 'tango'"), ([{}, {"id": 2}], ".*")],
)
def test_other_targets_than_the_dataset_has_are_refused_by_name(copy, other, said) -> None:
    (target,) = copy[0].record["targets"]
    change(copy, targets=[target | each for each in other])
    found = rf"nominal/img000001.json: has the targets {said}, and dataset.json 1 'tango'; run spin-usd check"
    with pytest.raises(InputError, match=found):
        copy[0].targets  # noqa: B018


def test_a_record_of_another_schema_is_told_so(copy) -> None:
    change(copy, schema="record-2")
    with pytest.raises(InputError, match=r"is of schema 'record-2', and this version reads record-1; read it with"):
        copy[0]


def test_a_file_of_other_channels_is_refused(copy) -> None:
    files = copy[0].files
    shutil.copy(copy.root / files["depth"].path, copy.root / files["dense_pose"].path)
    with pytest.raises(InputError, match=r"dense_pose/nominal/img000001.exr: .* not those of dense_pose; run spin"):
        copy[0].dense_pose  # noqa: B018


def test_geometry_is_read_only(dataset) -> None:
    picture = dataset[0]
    for name in ("camera_matrix", "distortion", "T_cam_body", "q_cam_body", "t_cam_body", "keypoint_pixels"):
        assert not getattr(picture, name).flags.writeable, name
    assert not picture.keypoints.points.flags.writeable
    (shown,) = picture.targets
    for name in ("T_cam_body", "q_cam_body", "t_cam_body", "box_visible", "box_amodal", "box", "box_3d", "keypoints"):
        assert not getattr(shown, name).flags.writeable, name


def test_a_file_that_is_gone_or_another_is_refused_by_name(copy) -> None:
    depth = copy.root / copy[0].files["depth"].path
    shutil.copy(copy.root / copy[0].files["dense_pose"].path, depth)
    change(copy, camera=copy[0].record["camera"] | {"width": 200})
    with pytest.raises(InputError, match=r"depth/nominal/img000001.exr: .* not those of depth"):
        copy[0].depth  # noqa: B018
    depth.unlink()
    with pytest.raises(InputError, match=r"depth/nominal/img000001.exr: is missing; restore it"):
        copy[0].depth  # noqa: B018


def test_files_outside_the_dataset_are_not_read(copy, tmp_path) -> None:
    shutil.copy(copy.root / copy[0].files["depth"].path, tmp_path / "outside.exr")
    depth = copy[0].record["files"]["depth"] | {"path": "../outside.exr"}
    change(copy, files={"depth": depth})
    with pytest.raises(
        InputError, match=r"at \$.files.depth.path: '../outside.exr' does not match .*; run spin-usd check"
    ):
        copy[0]
