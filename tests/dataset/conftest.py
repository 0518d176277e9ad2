"""A small rendered dataset."""

import pytest

FRAMES = 3


@pytest.fixture(scope="session")
def rendered(small_stage, tmp_path_factory, spin_usd):
    """The folder of a dataset of FRAMES pictures at 240 x 150, with radiance."""
    out = tmp_path_factory.mktemp("read") / "dataset"
    spin_usd("render", small_stage, "--out", out, "--renderer", "raycast", "--frames", f"0:{FRAMES}", "--radiance")
    return out
