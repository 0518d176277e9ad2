"""Nothing of the user's is written, read as ours or removed, whatever it is called and wherever links lead."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.commands.check.dataset import dataset_findings
from spin_usd.commands.render.run import render_dataset
from spin_usd.errors import InputError, SpinError
from spin_usd.options import RunOptions
from spin_usd.scene.effort import Effort
from spin_usd.store.dataset_folder import OWN
from tests.cases.requests import request_for
from tests.cases.root_layers import over_stage
from tests.conftest import REPOSITORY, speedplus_camera

TOKEN = "0123456789abcdef" * 2
CRAFT = """#usda 1.0
(
    defaultPrim = "Craft"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "Craft"
{
    def Cube "Body"
    {
        double size = 1
    }
}
"""
LOOK_ALIKES = (
    "notes.tmp-draft.txt",
    "a.tmp-1/x.tmp-2.png",
    "my/stuff/x.tmp-1",
    ".work/thesis",
    f".work-{TOKEN}/thesis",
    ".DS.20251122.bak/t",
    f".DS.{TOKEN}/.lock",
    "stage.tmp-old/x",
    "my/.lock",
    "image/.lock",
    f"image/nominal/.work-{TOKEN}/x",
    "image/nominal/img000001.tmp-12.png",
    "records/nominal/img000001.json.tmp-12",
    "records/notes.txt",
    "cache/notes.txt",
    "cache/renders/ab/a.b.c.exr",
    f"cache/renders/ab/{'ab' * 32}.{'0' * 8}.{'1' * 64}.exr",
    f"cache/depth/tmp/{TOKEN}.exr",
)


@pytest.fixture(scope="module")
def authored(tmp_path_factory):
    """A stage of two pictures at 80 x 50: its root layer."""
    folder = tmp_path_factory.mktemp("authored")
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=24)))
    return author(folder, folder / "stage")


def author(folder, out, **choices):
    poses = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
    usual = {"poses": poses, "target": "cubesat", "camera": folder / "camera.json", "frames": "0:2"}
    author_stage(**{**usual, **choices}, out=out)
    return out / "dataset.usda"


@pytest.fixture(scope="module")
def made(authored, tmp_path_factory):
    out = tmp_path_factory.mktemp("made") / "DS"
    assert make(authored, out).made == 2
    return out


@pytest.fixture
def dataset(made, tmp_path):
    return shutil.copytree(made, tmp_path / "DS")


@pytest.fixture
def outside(tmp_path):
    """A folder of the user's that no run may touch, named like our temporary files."""
    for name in ("run.tmp-1/t", "a.tmp-b", "renders/ab/a.b.c.exr", "img9.png", "nominal/img000001.png"):
        path = tmp_path / "P" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("mine")
    return tmp_path / "P"


def make(stage, out, **options):
    chosen = {name: options.pop(name) for name in ("frames", "effort") if name in options}
    request = request_for(stage, renderer="raycast", **{"effort": Effort(samples=1), **chosen})
    return render_dataset(request, out, RunOptions(workers=1, **options), progress=lambda *_: None)


def first_finding(dataset):
    found = next(dataset_findings(dataset, progress=lambda *_: None))
    return found.code, found.where, found.severity


def content(folder):
    """Every file's bytes, every link's goal and every folder below `folder`, by name."""
    found = {}
    for path in folder.rglob("*"):
        name = path.relative_to(folder).as_posix()
        found[name] = os.readlink(path) if path.is_symlink() else path.read_bytes() if path.is_file() else None
    return found


@pytest.mark.parametrize("name", [".work/thesis", ".lock", f".work-{TOKEN}/t", "stage/x", "a.tmp-1"])
@pytest.mark.parametrize("stage", ["good", "bad"])
def test_a_folder_with_anything_in_it_is_refused(authored, tmp_path, name, stage) -> None:
    """A1."""
    path = tmp_path / "u" / name
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    before = content(tmp_path / "u")
    (tmp_path / "bad.usda").write_text("nonsense")
    with pytest.raises(InputError, match=r"but no dataset\.json"):
        make(authored if stage == "good" else tmp_path / "bad.usda", tmp_path / "u")
    assert content(tmp_path / "u") == before


def test_a_folder_that_was_there_stays_when_nothing_comes_of_a_run(tmp_path) -> None:
    """A1."""
    (tmp_path / "u").mkdir()
    (tmp_path / "bad.usda").write_text("nonsense")
    with pytest.raises(SpinError):
        make(tmp_path / "bad.usda", tmp_path / "u")
    assert list((tmp_path / "u").iterdir()) == []


@pytest.mark.parametrize("name", [".st.20251122.bak/t", f".st.{TOKEN}/t", ".st.1.abcdefgh/t"])
def test_author_leaves_hidden_folders_alone(authored, tmp_path, name) -> None:
    """A3."""
    (tmp_path / name).parent.mkdir()
    (tmp_path / name).write_text("mine")
    author(authored.parent.parent, tmp_path / "st")
    assert (tmp_path / name).read_text() == "mine"


def test_a_link_among_a_datasets_files_is_left_alone_and_told(authored, dataset, outside) -> None:
    """B1."""
    before = content(outside)
    (dataset / "x").mkdir()
    (dataset / "x" / "y").symlink_to(outside)
    assert make(authored, dataset).reused == 2
    assert content(outside) == before
    assert first_finding(dataset) == ("link", "x/y", "warning")


@pytest.mark.parametrize("name", [*OWN, ".lock", "image/old", "stage/layers", "cache/renders"])
def test_a_link_in_a_datasets_own_place_is_refused_and_found(authored, dataset, outside, name) -> None:
    """B2, B3, B4. There is a picture to make and one to prune."""
    (dataset / "image" / "nominal" / "img000001.png").unlink()
    record = (dataset / "records" / "nominal" / "img000001.json").read_text()
    (dataset / "records" / "old").mkdir()
    named = record.replace("nominal", "old").replace("img000001", "img9")
    (dataset / "records" / "old" / "img9.json").write_text(named)
    place = dataset / name
    if place.is_dir():
        shutil.rmtree(place)
    place.unlink(missing_ok=True)
    place.symlink_to(outside / "new" if name == ".lock" else outside)
    before, held = content(outside), content(dataset)
    for _ in range(2):
        with pytest.raises(InputError, match=r"is not followed|not a lock of spin-usd"):
            make(authored, dataset, prune=True)
    assert (content(outside), content(dataset)) == (before, held)
    assert first_finding(dataset) == ("link", name, "error")


@pytest.mark.parametrize("name", ["dataset.json", "records/nominal/img000001.json", "cache/measured.json", ".lock"])
def test_a_pipe_in_a_dataset_is_refused_and_waited_for_by_nobody(
    authored, dataset, spin_usd, name, monkeypatch
) -> None:
    monkeypatch.setattr("spin_usd.store.dataset_folder.PATIENCE_S", 0.2)
    (dataset / name).unlink(missing_ok=True)
    os.mkfifo(dataset / name)
    with pytest.raises(InputError):
        make(authored, dataset)
    assert first_finding(dataset) == ("special", name, "error")
    if name == "cache/measured.json":
        assert "which is not followed" in spin_usd("plan", authored, "--out", dataset, code=2).stderr


def add_look_alikes(dataset, outside):
    """Everything that is called like something of ours, and links; what they hold, by path."""
    for name in LOOK_ALIKES:
        (dataset / name).parent.mkdir(parents=True, exist_ok=True)
        (dataset / name).write_text("mine")
    (dataset / "my" / "link.tmp-1").symlink_to(outside)
    (dataset / f".work-{TOKEN}" / "link").symlink_to(outside)
    for name in (f".DS.{TOKEN}", ".st.1.abcdefgh", f".st.{TOKEN}"):
        (dataset.parent / name).mkdir()
        (dataset.parent / name / ".lock").write_text("mine")
    return lambda: {
        **{name: (dataset / name).read_bytes() for name in LOOK_ALIKES},
        "beside": {name: each for name, each in content(dataset.parent).items() if name.startswith(".")},
        "links": [os.readlink(dataset / "my" / "link.tmp-1"), os.readlink(dataset / f".work-{TOKEN}" / "link")],
        "outside": content(outside),
    }


def killed_while_rendering(stage, out) -> None:
    """A run that is killed as soon as it has a work folder."""
    command = [sys.executable, "-m", "spin_usd.command_line", "render", stage, "--out", out, "--renderer", "raycast"]
    before = set(out.glob(".work-*"))
    process = subprocess.Popen([*command, "--samples", "2"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while set(out.glob(".work-*")) == before:
        assert process.poll() is None
        time.sleep(0.002)
    process.kill()
    assert process.wait() == -signal.SIGKILL


@pytest.mark.children
@pytest.mark.slow
def test_look_alikes_of_all_our_names_stay(authored, dataset, outside, tmp_path) -> None:
    """After a resumed run, a failing one, one that prunes, one without a cache, a killed one and the one after it, and
    author, which beside them leave nothing but a dataset."""
    look = add_look_alikes(dataset, outside)
    before = look()
    assert make(authored, dataset).reused == 2
    assert make(authored, dataset, frames="0:1", effort=Effort(samples=2), prune=True).made == 1
    with pytest.raises(InputError):
        make(authored, dataset, frames="9:")
    killed_while_rendering(authored, dataset)
    assert make(authored, dataset, effort=Effort(samples=2), verify=True, no_cache=True).made >= 1
    author(authored.parent.parent, tmp_path / "st")
    assert look() == before
    assert {path.name for path in dataset.iterdir() if path.name.startswith(".")} == {
        name.partition("/")[0] for name in LOOK_ALIKES if name.startswith(".")
    }


def test_what_a_user_put_into_the_stages_copy_is_not_replaced(authored, dataset) -> None:
    """Nor are layers that were edited there."""
    for name, text in {"notes.txt": "mine", "layers/lights.usda": "#usda 1.0\n"}.items():
        path = dataset / "stage" / name
        kept = path.read_bytes() if path.exists() else None
        path.write_text(text)
        before = content(dataset)
        with pytest.raises(InputError, match=f"stage/{name}: is not as spin-usd wrote it"):
            make(authored, dataset)
        assert content(dataset) == before
        path.unlink() if kept is None else path.write_bytes(kept)
    assert make(authored, dataset).reused == 2


def test_a_layer_that_the_stages_copy_has_lost_comes_back(authored, dataset) -> None:
    """And the list of its files, junk as it is: of these nothing is lost."""
    before = content(dataset)
    (dataset / "stage" / "layers" / "lights.usda").unlink()
    (dataset / "stage" / "SHA256SUMS").write_text("junk")
    assert make(authored, dataset).reused == 2
    assert content(dataset) == before


@pytest.mark.slow
def test_another_stage_replaces_pictures_only_when_told(authored, dataset, tmp_path, spin_usd) -> None:
    """One that was edited is the same stage still, and so is one over it."""
    edited = shutil.copytree(authored.parent, tmp_path / "edited")
    lights = edited / "layers" / "lights.usda"
    lights.write_text(lights.read_text().replace("1361", "1000"))
    over = edited / "over.usda"
    over.write_text(over_stage(frames=2))
    assert make(over, dataset).made == 2
    before = content(dataset)
    other = author(authored.parent.parent, tmp_path / "other", target="capsule", seed=1)
    with pytest.raises(InputError, match=r"another stage, which differs in: --seed, --target; .*--replace"):
        make(other, dataset)
    assert content(dataset) == before
    options = ("--out", dataset, "--renderer", "raycast", "--samples", 1, "--json")
    assert json.loads(spin_usd("plan", other, *options).stdout)["other_stage"] == ["seed", "target"]
    report = json.loads(spin_usd("render", other, *options, "--replace").stdout)
    assert (report["made"], report["pruned"]) == (2, 2)


@pytest.mark.parametrize(
    ("options", "kept"),
    [
        (
            {"seed": 2**62, "units_per_metre": 1.0, "sun_direction": (0.0, 0.0, -2.0), "channels": "rgb"},
            {"seed": 2**62, "units_per_metre": 1.0, "sun_direction": [0.0, 0.0, -1.0], "channels": "rgb"},
        ),
        (
            {"prim": "/Craft", "sun_from_target": (0.0, 3.0, 0.0)},
            {"seed": 0, "prim": "/Craft", "sun_from_target": [0.0, 1.0, 0.0]},
        ),
    ],
)
def test_every_option_that_decides_pictures_makes_another_stage(authored, dataset, tmp_path, options, kept) -> None:
    """And is in dataset.json as JSON."""
    (tmp_path / "craft.usda").write_text(CRAFT)
    other = author(authored.parent.parent, tmp_path / "other", target=tmp_path / "craft.usda", **options)
    with pytest.raises(InputError, match="another stage") as refused:
        make(other, dataset)
    changed = set(kept) if kept["seed"] else set(kept) - {"seed"}
    assert all(f"--{name.replace('_', '-')}" in str(refused.value) for name in changed)
    make(other, dataset, frames="0:1", replace=True)
    assert json.loads((dataset / "dataset.json").read_text())["stage"]["origin"]["options"] == kept


def test_a_renamed_file_makes_no_other_stage(authored, dataset, tmp_path) -> None:
    poses = shutil.copy(REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json", tmp_path / "renamed.json")
    assert make(author(authored.parent.parent, tmp_path / "same", poses=poses), dataset).reused == 2


@pytest.mark.slow
def test_two_stages_pictures_are_never_mixed(authored, dataset, tmp_path) -> None:
    """Replaced in part: what was the other stage's is gone, and what the user put beside it is not."""
    (dataset / "image" / "nominal" / "mine.txt").write_text("mine")
    other = author(authored.parent.parent, tmp_path / "other", target="capsule")
    report = make(other, dataset, frames="0:1", replace=True)
    assert (report.made, report.pruned) == (1, 2)
    assert [path.name for path in (dataset / "records").rglob("*.json")] == ["img000001.json"]
    found = list(dataset_findings(dataset, progress=lambda *_: None))
    assert [each for each in found if each.severity == "error"] == []
    assert [each.where for each in found if each.code == "stray"] == ["image/nominal/mine.txt"]
    with pytest.raises(InputError, match="another stage"):
        make(authored, dataset)
    (dataset / "records" / "nominal" / "precious.json").write_text("{}")
    before = content(dataset)
    with pytest.raises(InputError, match="precious"):
        make(authored, dataset, replace=True)
    assert content(dataset) == before


def test_strays_are_reported_of_the_datasets_own_places_alone(dataset) -> None:
    for name in ("notes/a/b.txt", "image.old/nominal/c.png", "image/nominal/sub/d.png", "cache/mine/e.txt"):
        (dataset / name).parent.mkdir(parents=True, exist_ok=True)
        (dataset / name).write_text("mine")
    findings = dataset_findings(dataset, progress=lambda *_: None)
    found = [each.where for each in findings if not each.where.startswith("/")]
    assert sorted(found) == ["cache/mine/e.txt", "image/nominal/sub/d.png"]


@pytest.mark.slow
def test_a_damaged_picture_is_made_again_when_told_to_verify(authored, dataset, spin_usd) -> None:
    path = dataset / "image" / "nominal" / "img000001.png"
    whole = path.read_bytes()
    path.write_bytes(whole[:-1] + b"x")
    assert make(authored, dataset).reused == 2
    options = ("--out", dataset, "--renderer", "raycast", "--samples", 1, "--json")
    report = json.loads(spin_usd("render", authored, *options, "--verify").stdout)
    assert (report["made"], report["reused"], path.read_bytes()) == (1, 1, whole)
    path.write_bytes(whole[:-1] + b"x")
    (dataset / "records" / "nominal" / "img000001.json").unlink()  # as `check` advises
    assert (make(authored, dataset).made, path.read_bytes()) == (1, whole)
