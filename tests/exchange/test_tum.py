"""TUM's trajectories: what is written is read back, by its own convention, with the pictures' times."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import clone, write_export

EPOCH_1970 = 1709280000.0  # of 2024-03-01T08:00:00Z


@pytest.fixture(scope="module")
def dataset(rendered, tmp_path_factory):
    """Three pictures that have times and UTC."""
    folder = clone(rendered, tmp_path_factory.mktemp("tum") / "set", [{"frame": name} for name in "abc"])
    for number, file in enumerate(sorted((folder / "records" / "nominal").iterdir())):
        said = {"time_s": 2.5 * number, "utc": f"2024-03-01T08:00:0{2.5 * number:.1f}Z".replace("00.0Z", "00Z")}
        file.write_text(json.dumps(json.loads(file.read_text()) | said))
    return folder


def test_each_line_is_where_the_camera_is(dataset, tmp_path) -> None:
    write_export(dataset, "tum", tmp_path / "out")
    lines = [line.split() for line in (tmp_path / "out" / "groundtruth.txt").read_text().splitlines()]
    assert lines[0][0] == "#"
    rows = np.array(lines[1:], float)
    assert rows[:, 0] == pytest.approx(EPOCH_1970 + np.array([0, 2.5, 5]), abs=1e-6)
    for row, picture in zip(rows, Dataset(dataset), strict=True):
        turn = Rotation.from_quat(row[4:])  # scalar last, camera to world
        point = np.array([0.3, -0.2, 4.0])  # camera
        in_body = turn.apply(point) + row[1:4]
        back = picture.T_cam_body @ np.array([*in_body, 1.0])
        assert back[:3] == pytest.approx(point)
    images = [line.split() for line in (tmp_path / "out" / "rgb.txt").read_text().splitlines()[1:]]
    assert [stamp for stamp, _ in images] == [line[0] for line in lines[1:]]
    assert all((tmp_path / "out" / file).is_file() for _, file in images)


def test_times_come_back(dataset, tmp_path) -> None:
    write_export(dataset, "tum", tmp_path / "tum")
    assert read_pose_list(tmp_path / "tum").times == pytest.approx([0, 2.5, 5])
    write_export(dataset, "nerfstudio", tmp_path / "nerf")
    assert read_pose_list(tmp_path / "nerf").times == pytest.approx([0, 2.5, 5])
