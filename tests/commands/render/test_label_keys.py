"""Labels that more decides than the geometry are made again when that changes, and no others are."""

import shutil

import pytest
from pxr import Gf, Sdf

from spin_usd.commands.render.run import render_dataset
from spin_usd.options import RunOptions
from spin_usd.scene.effort import Effort
from tests.cases.records import records_of
from tests.cases.requests import request_for

LABELS = ("depth", "classes", "lit", "flow")
POSES = 8


def make(stage, out, **request):
    request = {"labels": LABELS, "labels_only": True, **request}
    return render_dataset(
        request_for(stage, effort=Effort(samples=1), renderer="raycast", frames="5:8", **request),
        out,
        RunOptions(workers=1),
        progress=lambda *_: None,
    )


def digests(dataset):
    """sha256 by kind and frame."""
    records = records_of(dataset)
    return {(kind, each["frame"]): file["sha256"] for each in records for kind, file in each["files"].items()}


@pytest.fixture
def stage(small_stage, tmp_path):
    """The stage, to be edited."""
    return shutil.copytree(small_stage.parent, tmp_path / "stage") / small_stage.name


@pytest.fixture(scope="module")
def rendered(small_stage, tmp_path_factory):
    out = tmp_path_factory.mktemp("keys") / "dataset"
    make(small_stage, out)
    return out


@pytest.fixture
def dataset(rendered, tmp_path):
    """The dataset, the test's own."""
    return shutil.copytree(rendered, tmp_path / "dataset")


def changed(before, after):
    return {place for place in before if before[place] != after[place]}


def edit(stage, find, change):
    """Change the first attribute of a layer of the stage that `find` chooses."""
    for path in sorted(stage.parent.rglob("*.usd[ac]")):
        layer = Sdf.Layer.FindOrOpen(str(path))
        paths: list[Sdf.Path] = []
        layer.Traverse("/", paths.append)
        if found := next((at for at in paths if find(layer, at)), None):
            change(layer, found)
            layer.Save()
            return
    raise AssertionError("no such attribute")


def poses(layer, at):
    return at.name == "xformOp:translate" and len(layer.ListTimeSamplesForPath(at)) == POSES


def test_a_pose_that_moves_makes_its_own_labels_and_the_flow_to_it(stage, dataset) -> None:
    before = digests(dataset)

    def move(layer, at):
        time = layer.ListTimeSamplesForPath(at)[6]
        layer.SetTimeSample(at, time, layer.QueryTimeSample(at, time) + Gf.Vec3d(0.01, 0, 0))

    edit(stage, poses, move)
    assert make(stage, dataset).made == 2
    assert changed(before, digests(dataset)) == {
        ("flow", "img000006"),
        ("depth", "img000007"),
        ("classes", "img000007"),
        ("lit", "img000007"),
        ("flow", "img000007"),
    }


def test_flow_is_kept_up_to_date_where_it_is_not_asked_for(stage, dataset) -> None:
    before = digests(dataset)

    def move(layer, at):
        time = layer.ListTimeSamplesForPath(at)[7]
        layer.SetTimeSample(at, time, layer.QueryTimeSample(at, time) + Gf.Vec3d(0.01, 0, 0))

    edit(stage, poses, move)
    assert make(stage, dataset, labels=("depth",)).made == 2
    assert ("flow", "img000007") in changed(before, digests(dataset))


def test_records_name_the_next_frame_but_the_last(rendered) -> None:
    records = records_of(rendered)
    assert [record.get("next", {}).get("frame") for record in records] == ["img000007", "img000008", None]
    for record in records:
        keys = record["provenance"]["keys"]
        assert len({keys[name] for name in ("geometry", "classes", "lit", "flow")}) == 4


def test_another_sun_makes_lit_alone(stage, dataset) -> None:
    before = digests(dataset)

    def suns(layer, at):
        spec = layer.GetAttributeAtPath(at)
        return bool(spec) and at.name.startswith("xformOp:") and spec.owner.typeName == "DistantLight"

    def turn(layer, at):
        spec = layer.GetAttributeAtPath(at)
        spec.default = type(spec.default)(Gf.Vec3d(*spec.default) + Gf.Vec3d(20, 10, 0))

    edit(stage, suns, turn)
    assert make(stage, dataset).made == 3
    assert changed(before, digests(dataset)) == {("lit", f"img{number:06d}") for number in (6, 7, 8)}
