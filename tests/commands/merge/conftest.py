"""A stage of twelve pictures that shards make, and the dataset that one run makes of it."""

import json

import pytest

from spin_usd.commands.render.run import render_dataset
from spin_usd.options import RunOptions
from spin_usd.scene.effort import Effort
from tests.cases.requests import request_for
from tests.commands.merge.folder import content
from tests.conftest import REPOSITORY, speedplus_camera

RELIGHT = """schema = "augment-1"
seed = 0
[[augmentation]]
name = "dim"
count = 1
[augmentation.sample]
"lights.factor" = { distribution = "uniform", low = 0.4, high = 0.6 }
"""


@pytest.fixture(scope="session")
def stage(tmp_path_factory, spin_usd):
    """A stage of six poses in two variants at 60 x 38 that share renders and labels: its folder."""
    folder = tmp_path_factory.mktemp("sharded")
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=32)))
    (folder / "relight.toml").write_text(RELIGHT)
    poses = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
    given = ["--poses", poses, "--target", "cubesat", "--camera", folder / "camera.json", "--frames", "0:6"]
    spin_usd("author", *given, "--out", folder / "stage")
    spin_usd("augment", folder / "stage", "--spec", folder / "relight.toml")
    return folder / "stage"


@pytest.fixture(scope="session")
def make(stage):
    """Render the stage, or a shard of it, in this process."""

    def run(out, shard=None, *, renderer="raycast", variants=("all",), **options):
        request = request_for(
            stage / "dataset.usda",
            renderer=renderer,
            effort=Effort(samples=1),
            variants=variants,
            **{name: options.pop(name) for name in ("frames", "labels") if name in options},
        )
        return render_dataset(request, out, RunOptions(workers=1, shard=shard, **options), progress=lambda *_: None)

    return run


@pytest.fixture(scope="session")
def whole(make, tmp_path_factory):
    """The content of the dataset that a single run makes."""
    out = tmp_path_factory.mktemp("whole") / "dataset"
    assert make(out).made == 12
    return content(out)
