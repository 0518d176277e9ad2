"""Point clouds as files: every number comes back, equal clouds are equal bytes, and other programs read them."""

import hashlib
from typing import Any

import numpy as np
import pytest
import trimesh

from spin_usd.errors import InputError
from spin_usd.formats.array_file import encoded_point_cloud, read_point_cloud
from spin_usd.labels.lidar import POINT

HEADER = {"ImageDescription": "points of\na test", "spin:unit": "m"}


@pytest.fixture(params=[0, 1, 1000])
def cloud(request):
    rng, made = np.random.default_rng(3), np.zeros(request.param, POINT)
    for name in POINT.names:
        made[name] = (100 * rng.random(made[name].shape)).astype(POINT[name].base)
    return made


@pytest.mark.parametrize("suffix", [".npz", ".ply"])
def test_every_number_comes_back(cloud, suffix, tmp_path) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(encoded_point_cloud(cloud, path.suffix, header=HEADER))
    found = read_point_cloud(path)
    assert found.dtype == cloud.dtype
    np.testing.assert_array_equal(found, cloud)


@pytest.mark.parametrize("suffix", [".npz", ".ply"])
def test_equal_clouds_are_equal_bytes_at_any_time(cloud, suffix, tmp_path, monkeypatch) -> None:
    digests = set()
    for year in (2001, 2031):
        monkeypatch.setattr("time.time", lambda year=year: (year - 1970) * 3.15e7)
        path = tmp_path / f"{year}{suffix}"
        path.write_bytes(encoded_point_cloud(cloud, path.suffix, header=HEADER))
        digests.add(hashlib.sha256(path.read_bytes()).hexdigest())
    assert len(digests) == 1


def test_trimesh_reads_the_ply(cloud, tmp_path) -> None:
    if not len(cloud):
        pytest.skip("trimesh gives an empty scene for no points")
    (tmp_path / "a.ply").write_bytes(encoded_point_cloud(cloud, ".ply", header=HEADER))
    found: Any = trimesh.load(tmp_path / "a.ply")
    np.testing.assert_array_equal(np.asarray(found.vertices, np.float32), cloud["points"])
    data = found.metadata["_ply_raw"]["vertex"]["data"]
    for name in POINT.names[1:]:
        np.testing.assert_array_equal(np.ravel(data[name]), cloud[name])


def test_numpy_reads_the_npz(cloud, tmp_path) -> None:
    (tmp_path / "a.npz").write_bytes(encoded_point_cloud(cloud, ".npz", header=HEADER))
    with np.load(tmp_path / "a.npz", allow_pickle=False) as found:
        assert tuple(found.files) == POINT.names
        np.testing.assert_array_equal(found["points"], cloud["points"])


@pytest.mark.parametrize("suffix", [".npz", ".ply"])
@pytest.mark.parametrize("damage", [lambda data: data[:-7], lambda data: b"", lambda data: b"x" + data[1:]])
def test_a_damaged_file_is_refused(suffix, damage, tmp_path) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(encoded_point_cloud(np.zeros(5, POINT), path.suffix, header={}))
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match="make it again"):
        read_point_cloud(path)
