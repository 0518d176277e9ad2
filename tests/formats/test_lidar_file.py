"""LiDAR files: what they say reaches the LiDAR, and what they cannot say is refused by name."""

import json

import numpy as np
import pytest

from spin_usd.basics.resources import bundled, bundled_names
from spin_usd.errors import InputError
from spin_usd.formats.lidar_file import read_lidar_file

PLAIN = {
    "schema": "lidar-1",
    "pattern": "raster",
    "rows": 4,
    "columns": 6,
    "azimuth": [-10, 20],
    "elevation": [-5, 5],
    "range": [1, 50],
}


def read(tmp_path, **more):
    path = tmp_path / "own.json"
    path.write_text(json.dumps({**PLAIN, **more}))
    return read_lidar_file(path)


def test_a_plain_file_looks_where_the_camera_looks(tmp_path) -> None:
    lidar = read(tmp_path)
    np.testing.assert_array_equal(lidar.T_cam_lidar.rotation, [[0, -1, 0], [0, 0, -1], [1, 0, 0]])
    assert (lidar.rows, lidar.columns, lidar.azimuth_deg, lidar.range_limits) == (4, 6, (-10, 20), (1, 50))
    assert not lidar.by_chance


def test_noise_and_mounting_are_read(tmp_path) -> None:
    mounting = {"position": [1, 2, 3], "forward": [0, 2, 0], "up": [0, 0.3, -1]}
    lidar = read(tmp_path, noise={"constant": 0.1, "proportional": 0.2}, drop_out=0.3, mounting=mounting)
    assert (lidar.noise_constant, lidar.noise_proportional, lidar.drop_out) == (0.1, 0.2, 0.3)
    np.testing.assert_allclose(lidar.T_cam_lidar.directions(np.eye(3)), [[0, 1, 0], [1, 0, 0], [0, 0, -1]], atol=1e-15)
    np.testing.assert_array_equal(lidar.T_cam_lidar.translation, [1, 2, 3])


@pytest.mark.parametrize("name", bundled_names("lidar"))
def test_bundled_files_are_valid(name) -> None:
    assert read_lidar_file(bundled("lidar", name)).by_chance


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"pattern": "spiral"}, "pattern: 'spiral' is not one of"),
        ({"rows": 0}, "rows: 0 is less than the minimum of 1; compare it with "),
        ({"noise": {"sigma": 1}}, "noise: "),
        ({"azimuth": [20, -10]}, "azimuths are 20 to -10 degrees"),
        ({"rows": 9999, "columns": 9999}, "9999 rows and 9999 columns are not 1 to"),
        ({"mounting": {"up": [0, 0, 1]}}, "forward and up are the same direction"),
    ],
)
def test_what_cannot_be_is_refused(more, words, tmp_path) -> None:
    with pytest.raises(InputError) as refusal:
        read(tmp_path, **more)
    assert words in str(refusal.value)
    assert "own.json" in str(refusal.value)
    assert refusal.value.do


def test_a_file_that_is_not_toml_is_refused(tmp_path) -> None:
    path = tmp_path / "own.toml"
    path.write_text("pattern raster")
    with pytest.raises(InputError, match="is not TOML"):
        read_lidar_file(path)
