"""Right sets of hard pictures, exported by ourselves: `check` finds no error in them, whatever they show."""

import json

import pytest

from spin_usd import check
from tests.cases.foreign_sets import CAMERA

HARD = {
    "cut off": ("range=1.5..3 inside=0..0.8", ()),
    "tiny": ("range=50..64 inside=1", ()),
    "grazing Sun": ("range=4..10 inside=1 sun.direction=0,0,1:80", ()),
    "dark": ("range=4..10 inside=1 sun.direction=0,0,1:10", ()),
    "two bodies": ("range=4..10 inside=1 sun.direction=0,0,-1:70",
                   ("--also", "cubesat:distance=1..2 attitude=uniform")),
}  # fmt: skip
LAYOUTS = {"speedplus": (), "coco": (), "bop": (), "spark": ("--option", "layout=2024-stream1")}


@pytest.fixture(scope="module", params=HARD)
def hard(request, tmp_path_factory, spin_usd):
    """A dataset of one kind of hard pictures, and its camera."""
    folder = tmp_path_factory.mktemp("hard")
    sample, more = HARD[request.param]
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    spin_usd("author", "--sample", sample, "--count", 16, "--target", "microsat", "--camera", folder / "camera.json",
             "--any-size", *more, "--out", folder / "stage")  # fmt: skip
    spin_usd("render", folder / "stage", "--renderer", "raycast", "--workers", 1, "--labels",
             "default,instance,mask_amodal", "--out", folder / "dataset")  # fmt: skip
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", LAYOUTS)
def test_hard_pictures_are_no_errors(hard, tmp_path, spin_usd, name) -> None:
    spin_usd("export", hard / "dataset", "--to", name, *LAYOUTS[name], "--out", tmp_path / "set")
    options = {"camera": hard / "camera.json"} if name == "coco" else {}
    found = check(tmp_path / "set", **options).findings
    assert not [finding for finding in found if finding.severity == "error"]
