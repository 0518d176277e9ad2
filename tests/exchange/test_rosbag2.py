"""rosbag2: bags are read back by two other libraries as the dataset has them, and OpenCV projects with their camera."""

from datetime import timedelta

import cv2
import numpy as np
import pytest

from spin_usd.errors import MissingPackageError
from spin_usd.exchange.layout.stamps import START
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import clone, contents, write_export

reader = pytest.importorskip("mcap_ros2.reader")
rosbag2 = pytest.importorskip("rosbags.rosbag2")
TIMES = 0.0, 0.123456789, 7.5


def messages(bag):
    """Messages of a bag by topic, each with the nanoseconds of its record."""
    found: dict[str, list[tuple[int, object]]] = {}
    for each in reader.read_ros2_messages(bag):
        found.setdefault(each.channel.topic, []).append((each.log_time_ns, each.ros_msg))
    return found


@pytest.fixture(scope="module")
def timed(rendered, tmp_path_factory):
    """Three pictures of Tango with times, one of them by a fisheye."""
    fisheye = {"distortion": [0.01, 0.002, 0.0, 0.0], "model": "fisheye"}
    pictures = [{"frame": f"p{i}", "time": TIMES[i], "camera": fisheye if i == 2 else {}} for i in range(3)]
    return clone(rendered, tmp_path_factory.mktemp("timed") / "dataset", pictures)


@pytest.fixture(scope="module")
def bag(timed, tmp_path_factory):
    out = tmp_path_factory.mktemp("bags") / "out"
    write_export(timed, "rosbag2", out)
    return out / "nominal"


def test_the_messages_are_the_pictures(timed, bag) -> None:
    found = messages(bag / "nominal.mcap")
    topics = "/camera/image_raw", "/camera/depth", "/target/pose", "/tf"
    rows = zip(*(found[topic] for topic in topics), strict=True)
    for picture, second, row in zip(Dataset(timed), TIMES, rows, strict=True):
        stamp = START + timedelta(seconds=second)
        for time, message in row[:3]:
            assert message.header.frame_id == "camera_optical_frame"
            assert message.header.stamp.sec == int(stamp.timestamp())
            assert message.header.stamp.nanosec == round(second % 1 * 1e9)
            assert time == message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        image, depth, pose, tf = (message for _, message in row)
        assert (image.encoding, image.step) == ("mono8", image.width)
        np.testing.assert_array_equal(np.frombuffer(image.data, np.uint8).reshape(image.height, -1), picture.image)
        metres = np.frombuffer(depth.data, "<f4").reshape(depth.height, -1)
        assert depth.encoding == "32FC1"
        np.testing.assert_array_equal(np.nan_to_num(metres), picture.depth)
        assert (np.isnan(metres) == (picture.depth == 0)).all()
        (transform,) = tf.transforms
        assert transform.child_frame_id == "tango"
        for place, turn in ((pose.pose.position, pose.pose.orientation),
                            (transform.transform.translation, transform.transform.rotation)):  # fmt: skip
            np.testing.assert_allclose([place.x, place.y, place.z], picture.t_cam_body, rtol=1e-15)
            q = np.array([turn.w, turn.x, turn.y, turn.z])
            assert abs(abs(q @ picture.q_cam_body) - 1) < 1e-15


def test_opencv_projects_keypoints_with_its_camera(timed, bag) -> None:
    found = messages(bag / "nominal.mcap")
    for picture, (_, info) in zip(Dataset(timed), found["/camera/camera_info"], strict=True):
        points = picture.keypoints.points[None]
        rotation, _ = cv2.Rodrigues(picture.T_cam_body[:3, :3])
        fisheye = info.distortion_model == "equidistant"
        project = cv2.fisheye.projectPoints if fisheye else cv2.projectPoints
        order = (rotation, picture.t_cam_body, np.reshape(info.k, (3, 3)), np.array(info.d))
        seen = project(points, *order)[0].reshape(-1, 2)
        np.testing.assert_allclose(seen + 0.5, picture.keypoint_pixels, atol=1e-6)
    assert [info.distortion_model for _, info in found["/camera/camera_info"]] == ["plumb_bob"] * 2 + ["equidistant"]


def test_rosbags_reads_its_own_folder_and_the_bytes_are_the_same_again(timed, bag, tmp_path) -> None:
    with rosbag2.Reader(bag) as opened:
        assert opened.message_count == 15
        assert {each.topic: each.msgcount for each in opened.connections}["/tf"] == 3
    write_export(timed, "rosbag2", tmp_path / "again")
    assert contents(tmp_path / "again") == contents(bag.parent)
    (tmp_path / "again" / "nominal" / "metadata.yaml").unlink()
    write_export(timed, "rosbag2", tmp_path / "again")
    assert contents(tmp_path / "again") == contents(bag.parent)


@pytest.mark.slow
def test_a_lidar_has_its_points_and_its_frame(spin_usd, tmp_path) -> None:
    spin_usd("author", "--sample", "range=3 inside=1 count=1", "--target", "tango", "--camera", "speedplus",
             "--resolution", 64, "--lidar", "flash", "--out", tmp_path / "stage")  # fmt: skip
    spin_usd("render", tmp_path / "stage", "--out", tmp_path / "dataset", "--labels", "lidar", "--renderer", "raycast",
             "--samples", 1)  # fmt: skip
    spin_usd("export", tmp_path / "dataset", "--to", "rosbag2", "--out", tmp_path / "out")
    found = messages(tmp_path / "out" / "nominal" / "nominal.mcap")
    (_, cloud), (_, tf) = found["/lidar/points"][0], found["/tf"][0]
    lidar = Dataset(tmp_path / "dataset")[0].lidar
    points = np.frombuffer(cloud.data, "<f4").reshape(-1, 3)
    assert cloud.header.frame_id == "lidar_link"
    assert [each.name for each in cloud.fields] == ["x", "y", "z"]
    np.testing.assert_array_equal(points, lidar.points)
    placed = tf.transforms[1].transform
    assert tf.transforms[1].child_frame_id == "lidar_link"
    turn = placed.rotation
    w, v = turn.w, np.array([turn.x, turn.y, turn.z])
    turned = points + 2 * np.cross(v, np.cross(v, points) + w * points)
    place = placed.translation
    np.testing.assert_allclose(turned + np.array([place.x, place.y, place.z]), lidar.points_cam, atol=1e-6)
    assert "/camera/depth" not in found


def test_without_rosbags_one_sentence_says_what_to_install(rendered, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "rosbags", None)
    with pytest.raises(MissingPackageError, match=r"rosbag2 needs rosbags, which is not installed; run .*pip install"):
        write_export(rendered, "rosbag2", tmp_path / "out")
