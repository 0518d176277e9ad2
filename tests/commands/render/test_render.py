"""The main job on a small real stage: real workers, real Cycles, real kills."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Never

import psutil
import pytest

from spin_usd.commands.render.calls import MakePicture, OpenWorker
from spin_usd.commands.render.run import render_dataset
from spin_usd.commands.render.worker import RenderWorker
from spin_usd.errors import InputError, RenderError
from spin_usd.files.folder import Folder
from spin_usd.options import RunOptions
from spin_usd.planning.cost import read_measured
from spin_usd.planning.wall_time import one_core
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.processors import usable_cpus
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.store.cache import MEASURED
from spin_usd.store.json_schema import read_json
from tests.cases.records import record_at, record_files, records_of
from tests.cases.requests import request_for
from tests.conftest import REPOSITORY

SAMPLES = 2
FEW = Effort(samples=SAMPLES)


def quiet(*_) -> None:
    pass


def digests(dataset):
    """sha256 of every file by path, from the records."""
    records = records_of(dataset)
    return {entry["path"]: entry["sha256"] for record in records for entry in record["files"].values()}


def bytes_of_records(dataset):
    return {path.relative_to(dataset): path.read_bytes() for path in (dataset / "records").rglob("*.json")}


def make(stage, out, *, workers=1, **request):
    request = {"effort": FEW, "renderer": "raycast", **request}
    return render_dataset(request_for(stage, **request), out, RunOptions(workers=workers), progress=quiet)


@pytest.fixture(scope="module")
def blender_dataset(small_stage, tmp_path_factory):
    out = tmp_path_factory.mktemp("blender") / "dataset"
    report = make(small_stage, out, renderer="blender", workers=2, radiance=True)
    assert (report.made, report.failed) == (8, [])
    return out


@pytest.fixture(scope="module")
def rendered(small_stage, tmp_path_factory):
    out = tmp_path_factory.mktemp("rendered") / "dataset"
    make(small_stage, out, frames="0:4")
    return out


@pytest.fixture
def dataset(rendered, tmp_path):
    """A dataset of four pictures, the test's own."""
    return shutil.copytree(rendered, tmp_path / "dataset", symlinks=True)


def test_every_picture_has_its_files_and_a_valid_record(blender_dataset) -> None:
    read_json(Folder(blender_dataset), "dataset.json", "dataset-1")
    records = records_of(blender_dataset)
    assert [record["index"] for record in records] == list(range(8))
    kinds = {"image", "radiance", "depth", "segmentation", "dense_pose"}
    assert all(set(record["files"]) == kinds for record in records)


@pytest.mark.children
@pytest.mark.parametrize("workers", [1, 2])
def test_what_a_run_took_is_kept_as_seconds_of_one_core(small_stage, tmp_path, workers) -> None:
    report = make(small_stage, tmp_path, frames="0:2", workers=workers)
    alone = one_core(report.work, workers=workers, cores=len(usable_cpus()))
    assert read_measured(Folder(tmp_path), MEASURED).taken == pytest.approx(alone)


@pytest.mark.slow
def test_denoised_adaptive_reduced_pictures_do_not_depend_on_processes_and_processors(small_stage, tmp_path) -> None:
    """One worker has all processors and makes all pictures; of two each has its share."""
    effort = Effort(samples=32, adaptive=0.05, denoiser="fast", reduction=2)
    for workers in (1, 2):
        request = {"renderer": "blender", "effort": effort, "frames": "0:2", "labels": (), "radiance": True}
        make(small_stage, tmp_path / str(workers), workers=workers, **request)
    assert digests(tmp_path / "1") == digests(tmp_path / "2")


def test_the_independent_oracle_accepts_the_labels(blender_dataset, shared) -> None:
    oracle = [sys.executable, shared / "check" / "oracle.py", blender_dataset]
    done = subprocess.run(oracle, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_labels_are_of_no_renderer(small_stage, blender_dataset, rendered, tmp_path) -> None:
    """They have the same bytes and keys whatever renders the image, and alone they are made without Blender."""
    make(small_stage, tmp_path / "alone", frames="0:4", renderer="blender", labels_only=True)
    alone = records_of(tmp_path / "alone")
    assert len(alone) == 4
    for record in alone:
        files, keys = record["files"], record["provenance"]["keys"]
        assert set(files) == {"depth", "segmentation", "dense_pose"}
        assert "blender" not in record["provenance"]["versions"]
        for other in (record_of_frame(blender_dataset, record), record_of_frame(rendered, record)):
            assert {kind: other["files"][kind] for kind in files} == files
            assert other["provenance"]["keys"]["geometry"] == keys["geometry"]
            assert other["provenance"]["versions"].items() >= record["provenance"]["versions"].items()


def record_of_frame(dataset, record):
    return next(each for each in records_of(dataset) if each["frame"] == record["frame"])


def test_one_worker_and_two_make_the_same_bytes(small_stage, blender_dataset, tmp_path) -> None:
    make(small_stage, tmp_path / "one", renderer="blender", workers=1, radiance=True)
    assert digests(tmp_path / "one") == digests(blender_dataset)


def test_a_moved_dataset_is_right_and_reproduced(blender_dataset, tmp_path, spin_usd) -> None:
    moved = tmp_path / "elsewhere"
    shutil.copytree(blender_dataset, moved)
    findings = json.loads(spin_usd("check", moved, "--json").stdout)["findings"]
    assert {found["code"] for found in findings} <= {"nearly-black"}  # the Sun alone lights it, at times from the side
    made = json.loads(spin_usd("reproduce", moved, "img000003", "--json").stdout)
    assert len(made["files"]) == 5
    assert all(file["same"] for file in made["files"])


def test_a_picture_alone_is_the_picture_among_others(small_stage, blender_dataset, tmp_path) -> None:
    make(small_stage, tmp_path / "alone", renderer="blender", frames="5:6", radiance=True)
    alone = digests(tmp_path / "alone")
    assert len(alone) == 5
    assert alone.items() <= digests(blender_dataset).items()


def test_a_lost_description_is_written_again(small_stage, dataset) -> None:
    path = dataset / "dataset.json"
    before = path.read_bytes()
    path.write_text("{}")
    with pytest.raises(InputError, match="if it is a dataset's, run spin-usd check --repair"):
        make(small_stage, dataset, frames="0:4")
    path.unlink()
    report = make(small_stage, dataset, frames="0:4")
    assert (report.made, report.reused) == (0, 4)
    assert path.read_bytes() == before


def test_a_second_run_makes_nothing(small_stage, dataset) -> None:
    before = digests(dataset)
    report = make(small_stage, dataset, frames="0:4")
    assert (report.made, report.reused) == (0, 4)
    assert digests(dataset) == before


def test_what_is_lost_or_of_another_version_is_made_again(small_stage, dataset) -> None:
    before = digests(dataset)
    (dataset / "depth" / "nominal" / "img000001.exr").unlink()
    (dataset / "records" / "nominal" / "img000002.json").write_text("{")
    os.truncate(dataset / "segmentation" / "nominal" / "img000004.png", 0)  # as a power cut may leave it
    path = dataset / "records" / "nominal" / "img000003.json"
    record = json.loads(path.read_text())
    record["files"]["depth"]["channels"] = {"Z": "z"}
    path.write_text(json.dumps(record))
    report = make(small_stage, dataset, frames="0:4")
    assert (report.made, report.reused) == (4, 0)
    assert record_at(path)["files"]["depth"]["channels"] == {"Y": "z"}
    assert digests(dataset) == before


def test_labels_that_are_half_in_the_cache_make_the_same_record(small_stage, dataset) -> None:
    record = dataset / "records" / "nominal" / "img000001.json"
    before, depth = record.read_bytes(), record_at(record)["files"]["depth"]["sha256"]
    (cached,) = (dataset / "cache" / "depth").rglob(f"*.{depth}.exr")
    cached.unlink()
    record.unlink()
    assert make(small_stage, dataset, frames="0:4").made == 1
    assert record.read_bytes() == before


def test_more_samples_make_new_images_and_the_same_labels(small_stage, dataset) -> None:
    before = digests(dataset)
    assert make(small_stage, dataset, frames="0:2", effort=Effort(samples=SAMPLES + 1)).made == 2
    changed = {path for path, digest in digests(dataset).items() if before[path] != digest}
    assert changed == {"image/nominal/img000001.png", "image/nominal/img000002.png"}


def test_labels_alone_and_the_image_later(small_stage, tmp_path) -> None:
    make(small_stage, tmp_path, labels=("depth",), labels_only=True, frames="0:2")
    assert {path.split("/")[0] for path in digests(tmp_path)} == {"depth"}
    assert make(small_stage, tmp_path, labels=("segmentation",), frames="0:2").made == 2
    assert {path.split("/")[0] for path in digests(tmp_path)} == {"depth", "segmentation", "image"}


@pytest.mark.slow
def test_another_image_format_replaces_the_images(small_stage, dataset, spin_usd) -> None:
    make(small_stage, dataset, frames="0:4", image_format="jpg")
    assert {p.suffix for p in (dataset / "image" / "nominal").iterdir()} == {".jpg"}
    assert json.loads(spin_usd("check", dataset, "--json").stdout)["findings"] == []


def test_check_finds_each_flipped_byte(dataset, spin_usd) -> None:
    """In a file of every kind."""
    spoilt = [next((dataset / kind / "nominal").iterdir()) for kind in ("depth", "segmentation", "dense_pose", "image")]
    for path in spoilt:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
    found = json.loads(spin_usd("check", dataset, "--json", code=1).stdout)["findings"]
    named = {("sha256", str(path.relative_to(dataset))) for path in spoilt}
    assert ({(f["code"], f["where"]) for f in found}, len(found)) == (named, len(spoilt))


@pytest.mark.slow
def test_check_finds_labels_that_lie(dataset, spin_usd) -> None:
    """A pose that is off by a millimetre, with every digest right: of the picture alone, and of its target too."""
    path = record_files(dataset)[0]
    record = json.loads(path.read_text())
    record["pose"]["t_cam_body"][0] += 1e-3
    path.write_text(json.dumps(record))
    found = json.loads(spin_usd("check", dataset, "--json", code=1).stdout)["findings"]
    assert [f["code"] for f in found] == ["pose"]
    record["targets"][0]["pose"] = record["pose"]
    path.write_text(json.dumps(record))
    found = json.loads(spin_usd("check", dataset, "--json", code=1).stdout)["findings"]
    assert {"pose", "reprojection"} <= {f["code"] for f in found}


def test_a_picture_that_fails_leaves_no_file_of_its_own(small_stage, dataset, tmp_path, monkeypatch) -> None:
    """Its labels are made before its image fails; the pictures beside it keep all that they have."""
    settings = RenderSettings(renderer="raycast", effort=Effort(samples=SAMPLES + 1), seed=0)
    options = WorkerOptions(root=str(dataset), work=str(tmp_path), stage="stage/dataset.usda", settings=settings)
    worker = RenderWorker(OpenWorker(options=options))

    def fail(*_, **__) -> Never:
        raise RenderError("no light")

    monkeypatch.setattr(worker.studio.open_renderer(), "radiance", fail)
    before = digests(dataset)
    with pytest.raises(RenderError, match="no light"):
        worker.picture(MakePicture(variant="nominal", index=1, kinds=("image", "depth", "segmentation")))
    kept = {path: digest for path, digest in before.items() if "img000002" not in path}
    assert digests(dataset) == kept
    assert all((dataset / path).is_file() for path in kept)
    assert not (dataset / "depth" / "nominal" / "img000002.exr").exists()
    assert not list((dataset / "segmentation").rglob("img000002*"))


def start_render(stage, out, *options):
    command = [sys.executable, "-m", "spin_usd.command_line", "render", str(stage), "--out", str(out), *options]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def workers_of(process):
    try:
        return [c for c in psutil.Process(process.pid).children() if "spin_usd.processes.child_main" in c.cmdline()]
    except psutil.Error:
        return []


def count_of(out):
    return len(list((out / "records").glob("*/*.json")))


def killed(victims) -> bool:
    """Kill the last of these; False where it ended by itself since it was listed."""
    with suppress(psutil.NoSuchProcess):
        if victims:
            victims[-1].kill()
            return True
    return False


def kill(stage, out, *, after, wait_s, supervisor) -> None:
    """Start a render of eight pictures with Blender, and kill a worker or the supervisor a moment after so many of them
    are done.

    A killed worker must be replaced by the run itself; a killed supervisor's run is run again.
    """
    process = start_render(stage, out, "--renderer", "blender", "--effort", f"samples={SAMPLES}", "--workers", "2")
    while count_of(out) < after:
        assert process.poll() is None
        time.sleep(0.002)
    time.sleep(wait_s)
    while not killed([process] if supervisor else workers_of(process)):
        assert process.poll() is None
    code = process.wait(timeout=120)
    if not supervisor:
        assert (code, count_of(out)) == (0, 8)
        return
    assert code == -signal.SIGKILL
    report = make(stage, out, renderer="blender", workers=2)
    assert not report.failed
    assert report.made + report.reused == 8


def assert_whole(out, expected) -> None:
    assert digests(out) == expected
    assert not list(out.rglob(".*"))


@pytest.mark.children
@pytest.mark.slow
@pytest.mark.parametrize("supervisor", [False, True])
def test_kills_of_blender_lose_nothing(small_stage, blender_dataset, tmp_path, supervisor, spin_usd) -> None:
    """Early and late, right after a record was written and while the next files are: two workers have at least two more
    pictures each, so that one is there to kill."""
    expected = {path: sha256 for path, sha256 in digests(blender_dataset).items() if not path.startswith("radiance/")}
    for after, wait_s in ((1, 0), (3, 0.03)):
        out = tmp_path / f"killed{after}"
        kill(small_stage, out, after=after, wait_s=wait_s, supervisor=supervisor)
        assert_whole(out, expected)
    spin_usd("check", tmp_path / "killed1")


def test_check_finds_a_layer_that_was_edited_afterwards(dataset, spin_usd) -> None:
    layer = dataset / "stage" / "layers" / "lights.usda"
    layer.write_text(layer.read_text() + "# a comment\n")
    found = json.loads(spin_usd("check", dataset, "--json", code=1).stdout)["findings"]
    assert [(f["code"], f["where"]) for f in found] == [("layer", "stage/layers/lights.usda")]


def edited(stage, folder, old, new):
    """A copy of the stage in `folder` with the text `old` of its lights layer replaced."""
    shutil.copytree(stage.parent, folder, dirs_exist_ok=True)
    layer = folder / "layers" / "lights.usda"
    text = layer.read_text()
    assert old in text
    layer.write_text(text.replace(old, new))
    return folder / stage.name


@pytest.mark.slow
def test_a_changed_stage_makes_again_what_it_changes(small_stage, dataset, tmp_path, spin_usd) -> None:
    """A comment changes no picture, a light every image and no label; afterwards nothing is out of date."""
    before = digests(dataset)
    commented = edited(small_stage, tmp_path / "s1", "#usda 1.0", "#usda 1.0\n# a comment")
    assert make(commented, dataset, frames="0:4").made == 0
    assert digests(dataset) == before
    make(commented, tmp_path / "anew", frames="0:4")
    assert bytes_of_records(dataset) == bytes_of_records(tmp_path / "anew")
    assert json.loads(spin_usd("check", dataset, "--json").stdout)["findings"] == []
    brighter = edited(small_stage, tmp_path / "s2", "1361", "680.5")
    assert make(brighter, dataset, frames="0:4").made == 4
    changed = {path for path, digest in digests(dataset).items() if before[path] != digest}
    assert {path.split("/")[0] for path in changed} == {"image"}
    assert json.loads(spin_usd("check", dataset, "--json").stdout)["findings"] == []


def test_the_datasets_own_stage_can_be_rendered_in_place(dataset) -> None:
    before = digests(dataset)
    assert make(dataset / "stage" / "dataset.usda", dataset).made == 4  # the four that were left out
    assert before.items() <= digests(dataset).items()


def test_a_dataset_is_not_mixed_with_another_stages_pictures(small_stage, dataset, tmp_path, spin_usd) -> None:
    poses = json.loads((REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json").read_text())
    for pose in poses:
        pose["filename"] = "other_" + pose["filename"]
    (tmp_path / "poses.json").write_text(json.dumps(poses))
    spin_usd("author", "--poses", tmp_path / "poses.json", "--target", "tango", "--camera", "speedplus",
             "--out", tmp_path / "other")  # fmt: skip
    before = digests(dataset)
    with pytest.raises(InputError, match="img000001"):
        make(tmp_path / "other" / "dataset.usda", dataset)
    assert digests(dataset) == before
    assert (dataset / "stage" / "layers").is_dir()


@pytest.fixture(scope="module")
def shorter(small_stage, tmp_path_factory, spin_usd):
    """The small stage's first three pictures, as a stage of their own."""
    out = tmp_path_factory.mktemp("shorter") / "stage"
    poses, camera = (small_stage.parents[1] / name for name in ("poses.json", "camera.json"))
    spin_usd("author", "--poses", poses, "--target", "cubesat", "--camera", camera, "--frames", "0:3",
             "--out", out)  # fmt: skip
    return out / "dataset.usda"


def cached_labels(dataset):
    return len(list((dataset / "cache" / "depth").rglob("*.exr")))


@pytest.mark.slow
def test_pruning_removes_what_the_stage_does_not_have_and_nothing_else(small_stage, shorter, dataset, spin_usd) -> None:
    make(small_stage, dataset)
    (dataset / "image" / "nominal" / "notes.txt").write_text("mine")
    before = digests(dataset)
    planned = json.loads(spin_usd("plan", shorter, "--out", dataset, "--json").stdout)
    assert planned["orphans"] == 5
    assert "5 pictures" in spin_usd("plan", shorter, "--out", dataset).stdout
    refused = spin_usd("render", shorter, "--out", dataset, "--renderer", "raycast", code=2).stderr
    assert "5 pictures" in refused
    assert "--prune" in refused
    assert digests(dataset) == before
    options = ("--renderer", "raycast", "--samples", SAMPLES, "--json", "--prune")
    report = json.loads(spin_usd("render", shorter, "--out", dataset, *options).stdout)
    assert (report["pruned"], report["made"], report["reused"]) == (5, 0, 3)
    kept = {path: digest for path, digest in before.items() if path.split(".")[0][-1] in "123"}
    assert digests(dataset) == kept
    assert {p.name for p in (dataset / "image" / "nominal").iterdir()} == {
        "notes.txt", *(path.rpartition("/")[2] for path in kept if path.startswith("image/"))
    }  # fmt: skip
    assert cached_labels(dataset) == 3
    (found,) = json.loads(spin_usd("check", dataset, "--json").stdout)["findings"]
    assert (found["code"], found["where"], found["severity"]) == ("stray", "image/nominal/notes.txt", "warning")


@pytest.mark.slow
def test_a_kill_while_pruning_leaves_no_record_of_what_is_gone(small_stage, shorter, dataset, monkeypatch) -> None:
    make(small_stage, dataset)
    unlink = os.unlink
    removed: list[Path] = []

    def killed(path, **options) -> None:
        if "img00000" in str(path) and len(removed) == 6:  # of a picture's five names, the second picture's first
            raise KeyboardInterrupt
        unlink(path, **options)
        removed.extend([Path(path)] * ("img00000" in str(path)))

    monkeypatch.setattr(os, "unlink", killed)
    with pytest.raises(KeyboardInterrupt):
        render_dataset(
            request_for(shorter, renderer="raycast", effort=FEW), dataset, RunOptions(prune=True), progress=quiet
        )
    monkeypatch.undo()
    assert [path.suffix for path in removed] == [".json", *(p.suffix for p in removed[1:5]), ".json"]
    assert all((dataset / path).is_file() for path in digests(dataset))
    report = render_dataset(
        request_for(shorter, renderer="raycast", effort=FEW), dataset, RunOptions(prune=True), progress=quiet
    )
    assert (report.pruned, report.made, report.reused) == (3, 0, 3)


@pytest.mark.parametrize("text", ["a note", "{}", '{"files": {"stage": {"path": "stage/nominal/precious.json"}}}'])
def test_what_is_no_record_is_not_pruned(shorter, dataset, text) -> None:
    """Nor is the picture beside it that would be."""
    for path in (dataset / "records" / "nominal" / "precious.json", dataset / "stage" / "nominal" / "precious.json"):
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    before = {path: path.read_bytes() for path in dataset.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match="precious"):
        render_dataset(
            request_for(shorter, renderer="raycast", effort=FEW), dataset, RunOptions(prune=True), progress=quiet
        )
    assert {path: path.read_bytes() for path in dataset.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("held", ["dataset.json", "stage/precious.txt", "a.tmp-b.txt"])
def test_a_folder_that_is_no_dataset_is_left_alone(small_stage, tmp_path, held) -> None:
    path = tmp_path / "out" / held
    path.parent.mkdir(parents=True)
    path.write_text('{"a": 1}')
    with pytest.raises(InputError):
        make(small_stage, tmp_path / "out")
    assert [p for p in (tmp_path / "out").rglob("*") if p.is_file()] == [path]


def test_a_spoilt_record_harms_no_file(small_stage, dataset) -> None:
    before = digests(dataset)
    spoilt = ('{"files": []}', '{"files": {"depth": {"path": "stage/layers/lights.usda"}}}', "[]")
    for number, text in enumerate(spoilt, start=1):
        (dataset / "records" / "nominal" / f"img00000{number}.json").write_text(text)
    assert make(small_stage, dataset, frames="0:4").made == len(spoilt)
    assert digests(dataset) == before
    assert (dataset / "stage" / "layers" / "lights.usda").is_file()


@pytest.mark.parametrize(("effort", "names"), [({"denoiser": "fast"}, "denoiser"), ({"adaptive": 0.1}, "adaptive")])
def test_the_preview_refuses_what_only_a_path_tracer_does(effort, names) -> None:
    request_for(Path("stage"), renderer="raycast", effort=Effort(samples=3, reduction=2))
    with pytest.raises(InputError, match=f"raycast has no {names}"):
        request_for(Path("stage"), renderer="raycast", effort=Effort(samples=3, reduction=2, **effort))


def test_a_copy_of_the_stage_that_cannot_be_written_is_not_called_the_stage(small_stage, tmp_path) -> None:
    """A limit on the size of a file stands for a full disk."""
    stage = shutil.copytree(small_stage.parent, tmp_path / "stage") / small_stage.name
    stage.write_text(stage.read_text() + "# long\n" * 200_000)
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (10**6, 10**6))  # noqa: E731
    command = [sys.executable, "-m", "spin_usd.command_line", "render", stage, "--out", tmp_path / "out"]
    done = subprocess.run([*command, "--renderer", "raycast"], preexec_fn=limit, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith(f"spin-usd: {tmp_path}/out: the stage's copy cannot be written (File too large)")
    assert not (tmp_path / "out").exists()
