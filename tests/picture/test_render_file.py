"""A render as a file: every number of every light group comes back, in the same order in memory."""

import numpy as np
import pytest

from spin_usd.files.folder import FileIn, Folder
from spin_usd.geometry.region import Region
from spin_usd.picture.render_file import encoded_render, in_order, read_render
from spin_usd.scene.passes import Radiance

ODD = Region(x0=3, y0=5, x1=20, y1=16)


def radiance(region, groups):
    rng = np.random.default_rng(groups)
    lit = (10.0 ** rng.uniform(-30, 30, (groups, *region.shape, 3))).astype(np.float32)
    return Radiance(region=region, groups=lit, coverage=rng.random(region.shape, np.float32))


@pytest.mark.parametrize("groups", [0, 1, 3, 13, 120])
@pytest.mark.parametrize("region", [ODD, Region(x0=4, y0=4, x1=5, y1=5), Region(x0=9, y0=2, x1=9, y1=2)])
def test_a_render_comes_back_bit_for_bit(tmp_path, region, groups) -> None:
    written = radiance(region, groups)
    (tmp_path / "r.exr").write_bytes(encoded_render(written))
    found = read_render(FileIn(Folder(tmp_path), "r.exr"), region, groups=groups)
    assert found.region == region
    assert found.groups.tobytes() == written.groups.tobytes()
    assert found.coverage.tobytes() == written.coverage.tobytes()


def test_what_is_not_that_render_is_none(tmp_path) -> None:
    (tmp_path / "r.exr").write_bytes(encoded_render(radiance(ODD, 2)))
    assert read_render(FileIn(Folder(tmp_path), "r.exr"), ODD, groups=3) is None
    assert read_render(FileIn(Folder(tmp_path), "r.exr"), Region(x0=3, y0=5, x1=21, y1=16), groups=2) is None
    assert read_render(FileIn(Folder(tmp_path), "none.exr"), ODD, groups=2) is None
    (tmp_path / "r.exr").write_bytes(b"no image")
    assert read_render(FileIn(Folder(tmp_path), "r.exr"), ODD, groups=2) is None


def test_sums_round_alike_however_a_renderer_lays_its_planes_out(tmp_path) -> None:
    written = radiance(ODD, 40)
    planes_last = np.moveaxis(np.ascontiguousarray(np.moveaxis(written.groups, 0, -1)), -1, 0)
    other = in_order(Radiance(region=ODD, groups=planes_last, coverage=written.coverage))
    (tmp_path / "r.exr").write_bytes(encoded_render(other))
    found = read_render(FileIn(Folder(tmp_path), "r.exr"), ODD, groups=40)
    gains = [(1 + i / 7, 1 / 3, 2.0) for i in range(40)]
    assert found.relit(gains).groups.tobytes() == other.relit(gains).groups.tobytes()
    assert found.relit(gains).groups.tobytes() == written.relit(gains).groups.tobytes()
