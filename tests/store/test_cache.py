"""Results by content: each pass made once, whatever the order, the workers, the kills and the state of the cache."""

import json
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from spin_usd.commands.render.run import render_dataset
from spin_usd.files.folder import Folder
from spin_usd.formats.image_file import read_image, write_image
from spin_usd.labels.table import LABELS
from spin_usd.options import RunOptions
from spin_usd.picture.versions import library_versions
from spin_usd.scene.effort import Effort
from spin_usd.store.cache import RENDERS, Cache, entries, made_by
from spin_usd.store.dataset_folder import Store
from tests.cases.records import record_at, record_files
from tests.cases.requests import request_for
from tests.cases.root_layers import over_stage

VARIANTS = ("nominal", "dim", "starry", "matt", "wide", "noisy")
FRAMES = "0:3"
AUGMENTATIONS = """
variantSet "augmentation" = {
    "dim" {
        over "Lights" {
            over "Sun" {
                float inputs:intensity = 400
            }
        }
    }
    "matt" {
        over "Target" {
            over "Model" (
                variants = {
                    string look = "matt"
                }
            )
            {
            }
        }
    }
    "noisy" {
        over "Camera" (
            prepend apiSchemas = ["SpinOpticsAPI"]
        )
        {
            double spin:optics:psfSigma = 0.7
            bool spin:sensor:autoExposure = 1
            double spin:sensor:gain = 4
            double spin:sensor:readNoise = 8
        }
    }
    "starry" {
        over "Lights" {
            over "Sun" {
                color3f inputs:color = (1, 0.6, 0.4)
            }
        }
        over "Environment" {
            def Xform "Stars" (
                prepend apiSchemas = ["SpinStarsAPI"]
            )
            {
                double spin:stars:limitingMagnitude = 6.5
                int64 spin:stars:seed = 3
            }
        }
    }
    "wide" {
        over "Camera" {
            float horizontalApertureOffset = 0.0007032
            float omni:lensdistortion:opencvPinhole:cx = 118.5
            double spin:lens:cx = 118.5
        }
    }
}
"""


@pytest.fixture(scope="module")
def stage(small_stage, tmp_path_factory):
    """The small stage with five variants: a weaker Sun; another colour and background; materials; lens; detector."""
    return augmented(small_stage, tmp_path_factory.mktemp("augmented"))


def augmented(small, folder):
    shutil.copytree(small.parent, folder, dirs_exist_ok=True)
    sets = 'prepend variantSets = "augmentation"'
    (folder / "augmented.usda").write_text(over_stage(frames=8, metadata=sets, body=AUGMENTATIONS))
    return folder / "augmented.usda"


def make(stage, out, *, workers=1, no_cache=False, **request):
    request = {
        "effort": Effort(samples=2),
        "renderer": "raycast",
        "frames": FRAMES,
        "variants": VARIANTS,
        "radiance": True,
    } | request
    made = render_dataset(
        request_for(stage, **request), out, RunOptions(workers=workers, no_cache=no_cache), progress=lambda *_: None
    )
    assert made.failed == []
    return made


def passes(report):
    return report.made, report.label_passes, report.labels_shared, report.renders, report.renders_shared


def records(dataset):
    """The records by their path."""
    return {path.relative_to(dataset): record_at(path) for path in record_files(dataset)}


def digests(dataset):
    """sha256 of every file by path, as recorded and as found."""
    found = {e["path"]: e["sha256"] for record in records(dataset).values() for e in record["files"].values()}
    assert not [path for path in found if not (dataset / path).is_file()]
    return found


def cached(dataset, kind="renders"):
    return [entry.file.path for entry in entries(Store(root=dataset)) if entry.purpose.kind == kind]


def assert_without_cache(dataset) -> None:
    """But for what its runs have measured."""
    assert {path.name for path in (dataset / "cache").glob("*")} <= {"measured.json"}


def findings(spin_usd, dataset, code=0):
    return json.loads(spin_usd("check", dataset, "--json", code=code).stdout)["findings"]


@pytest.fixture(scope="module")
def whole(stage, tmp_path_factory):
    out = tmp_path_factory.mktemp("whole") / "dataset"
    # Intrinsics alone change labels; they and the material change the render.
    assert passes(make(stage, out)) == (18, 6, 12, 9, 9)
    return out


@pytest.fixture
def dataset(whole, tmp_path):
    """A copy, in which cached labels are files of their own."""
    return shutil.copytree(whole, tmp_path / "dataset")


def assert_alone_is_the_same(stage, whole, tmp_path, variant, index, renderer) -> None:
    out = tmp_path / f"{variant}{index}"
    made = make(stage, out, no_cache=True, variants=(variant,), frames=f"{index}:{index + 1}", renderer=renderer)
    assert passes(made) == (1, 1, 0, 1, 0)
    assert_without_cache(out)
    together = records(whole)
    for path, record in records(out).items():
        assert record == together[path]
        assert len(record["files"]) == 5
        for entry in record["files"].values():
            assert (out / entry["path"]).read_bytes() == (whole / entry["path"]).read_bytes()


@pytest.mark.parametrize(
    ("variant", "index"),
    [
        pytest.param(variant, i % 3, marks=[] if variant in ("nominal", "starry", "noisy") else [pytest.mark.slow])
        for i, variant in enumerate(VARIANTS)
    ],
)
def test_a_picture_alone_without_a_cache_is_the_picture_among_others(stage, whole, tmp_path, variant, index) -> None:
    assert_alone_is_the_same(stage, whole, tmp_path, variant, index, "raycast")


@pytest.mark.slow
def test_every_variant_of_blender_alone_is_the_picture_among_others(stage, tmp_path) -> None:
    whole = tmp_path / "whole"
    assert passes(make(stage, whole, renderer="blender", workers=2)) == (18, 6, 12, 9, 9)
    for i, variant in enumerate(VARIANTS):
        assert_alone_is_the_same(stage, whole, tmp_path, variant, i % 3, "blender")


@pytest.mark.slow
def test_blenders_picture_from_another_variants_render_is_its_own(stage, tmp_path) -> None:
    both = tmp_path / "both"
    made = make(stage, both, renderer="blender", frames="1:2", variants=("nominal", "starry"))
    assert passes(made) == (2, 1, 1, 1, 1)
    assert_alone_is_the_same(stage, both, tmp_path, "starry", 1, "blender")


@pytest.mark.slow
def test_two_workers_make_no_pass_twice_and_the_same_bytes(stage, whole, tmp_path) -> None:
    assert passes(make(stage, tmp_path / "two", workers=2)) == (18, 6, 12, 9, 9)
    assert digests(tmp_path / "two") == digests(whole)
    assert {p.name for p in cached(tmp_path / "two")} == {p.name for p in cached(whole)}


@pytest.mark.slow
def test_two_workers_make_no_pass_of_a_single_frame_twice(stage, tmp_path) -> None:
    """All variants need the first one's labels."""
    assert passes(make(stage, tmp_path / "two", workers=2, frames="0:1")) == (6, 2, 4, 3, 3)


@pytest.mark.slow
def test_a_variant_added_later_costs_its_difference(stage, whole, tmp_path) -> None:
    out = tmp_path / "dataset"
    assert passes(make(stage, out, variants=("nominal", "matt"))) == (6, 3, 3, 6, 0)
    assert passes(make(stage, out, variants=("nominal", "matt", "noisy"))) == (3, 0, 3, 0, 3)
    assert passes(make(stage, out, variants=("wide",))) == (3, 3, 0, 3, 0)
    assert passes(make(stage, out)) == (6, 0, 6, 0, 6)
    assert digests(out) == digests(whole)


def test_a_run_says_what_was_shared(stage, tmp_path, spin_usd) -> None:
    command = ["render", stage, "--out", tmp_path / "d", "--samples", 2, "--renderer", "raycast", "--frames", "0:1"]
    line = spin_usd(*command, "--variants", "nominal,dim").stdout
    assert "(2 pictures made, 0 already there, in " in line
    assert "1 label pass made, 1 shared; 1 render made, 1 shared)" in line
    report = json.loads(spin_usd(*command, "--variants", "nominal,dim", "--json").stdout)
    assert (report["made"], report["reused"], report["renders"], report["renders_shared"]) == (0, 2, 0, 0)


@pytest.mark.slow
def test_without_a_cache_the_results_are_the_same(stage, whole, tmp_path, spin_usd) -> None:
    out = tmp_path / "dataset"
    assert passes(make(stage, out, no_cache=True)) == (18, 6, 12, 9, 9)
    assert digests(out) == digests(whole)
    assert_without_cache(out)
    assert findings(spin_usd, out) == []


def test_a_finished_dataset_can_be_rid_of_its_cache(stage, dataset) -> None:
    before = digests(dataset)
    assert passes(make(stage, dataset, no_cache=True)) == (0, 0, 0, 0, 0)
    assert_without_cache(dataset)
    assert digests(dataset) == before


@pytest.mark.slow
def test_a_cache_deleted_by_hand_is_only_lost_time(stage, dataset, spin_usd) -> None:
    before = digests(dataset)
    shutil.rmtree(dataset / "cache")
    assert make(stage, dataset).made == 0
    (dataset / "image" / "starry" / "img000002.png").unlink()
    assert passes(make(stage, dataset)) == (1, 1, 0, 1, 0)
    assert digests(dataset) == before
    assert findings(spin_usd, dataset) == []


def test_a_lost_image_is_developed_again(stage, dataset) -> None:
    before = digests(dataset)
    (dataset / "image" / "noisy" / "img000003.png").unlink()
    assert passes(make(stage, dataset)) == (1, 0, 1, 0, 1)
    assert digests(dataset) == before


def flip(path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def cut(path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def replace_by_another(path) -> None:
    """A good image of the right size and channels, which is not what the name says."""
    pixels, names = read_image(path)
    write_image(path, pixels + np.float32(1), channels=names)


def empty(path) -> None:
    path.write_bytes(b"")


SPOILS = (flip, cut, replace_by_another, empty)


@pytest.mark.slow
def test_damaged_files_are_never_served_but_made_again(stage, dataset, spin_usd) -> None:
    before = digests(dataset)
    paths = [*cached(dataset), *cached(dataset, "depth")]
    for i, path in enumerate(paths):
        SPOILS[i % len(SPOILS)](path)
    wrong = findings(spin_usd, dataset)
    assert {(f["code"], f["severity"]) for f in wrong} == {("cache", "warning")}
    assert {f["where"] for f in wrong} == {str(path.relative_to(dataset)) for path in paths}
    for variant in ("dim", "starry"):
        shutil.rmtree(dataset / "image" / variant)
    assert passes(make(stage, dataset)) == (6, 3, 3, 3, 3)
    assert digests(dataset) == before


def test_a_file_of_other_software_is_not_served(whole, tmp_path) -> None:
    entry = next(entries(Store(root=whole)))
    purpose = entry.purpose
    versions = next(iter(records(whole).values()))["provenance"]["versions"]
    of_versions = partial(Cache, folder=Folder(whole), work=tmp_path)
    own, other = (of_versions(versions=found) for found in (versions, versions | {"spin_usd": "0"}))
    assert own.find(purpose.kind, purpose.key) == entry
    assert other.find(purpose.kind, purpose.key) is None


def test_a_label_serves_every_renderer_and_a_render_its_own_alone() -> None:
    one, other = library_versions(), library_versions() | {"blender": "5.2.3"}
    assert made_by(one, "depth") == made_by(other, "depth")
    assert made_by(one, "depth") != made_by(one | {"embreex": "3"}, "depth")
    assert made_by(one, RENDERS) != made_by(other, RENDERS)
    assert made_by(one, RENDERS) == made_by(one | {"scipy": "3"}, RENDERS)  # which develops images


def test_a_label_in_other_channels_is_not_served(whole, tmp_path, monkeypatch) -> None:
    entry = next(entry for entry in entries(Store(root=whole)) if entry.purpose.kind == "depth")
    versions = next(iter(records(whole).values()))["provenance"]["versions"]
    cache = Cache(folder=Folder(whole), versions=versions, work=tmp_path)
    assert cache.find("depth", entry.purpose.key) == entry
    depth = LABELS["depth"]
    monkeypatch.setitem(LABELS, "depth", replace(depth, channels=replace(depth.channels, holds={"Z": "z"})))
    assert cache.find("depth", entry.purpose.key) is None


@pytest.mark.slow
def test_check_tells_what_in_the_cache_is_of_no_use(stage, dataset, spin_usd) -> None:
    (dataset / "cache" / "notes.txt").write_text("mine")
    (dataset / "cache" / "measured.json").write_text("{}")
    shutil.rmtree(dataset / "records" / "wide")
    found = findings(spin_usd, dataset)
    assert {f["severity"] for f in found} == {"warning"}
    of_cache = [f["where"] for f in found if f["code"] == "cache"]
    assert len([where for where in of_cache if "/renders/" in where]) == 3
    assert "cache/notes.txt" in of_cache
    assert "cache/measured.json" not in of_cache


@pytest.mark.slow
def test_labels_of_one_geometry_are_one_file_and_replaced_one_by_one(stage, tmp_path) -> None:
    out = tmp_path / "dataset"
    make(stage, out, frames="0:1", variants=("nominal", "dim"))
    one, other = (out / "dense_pose" / variant / "img000001.exr" for variant in ("nominal", "dim"))
    assert one.samefile(other)
    assert one.samefile(cached(out, "dense_pose")[0])
    content = other.read_bytes()
    flip(one)  # in place: it is the same file
    assert other.read_bytes() != content
    shutil.rmtree(out / "records")
    make(stage, out, frames="0:1", variants=("nominal", "dim"))
    assert one.read_bytes() == other.read_bytes() == content


@pytest.mark.slow
def test_a_texture_concerns_those_who_show_it(small_tango_stage, tmp_path, spin_usd) -> None:
    """Of the looks, `reflective` shows the solar cells' image and `matt` does not."""
    own, out = augmented(small_tango_stage, tmp_path / "stage"), tmp_path / "dataset"
    assert passes(make(own, out, variants=("nominal", "matt"))) == (6, 3, 3, 6, 0)
    before, renders = digests(out), {path.name for path in cached(out)}
    path = tmp_path / "stage" / "targets" / "tango" / "textures" / "solar_cell.png"
    pixels, names = read_image(path)
    write_image(path, 255 - pixels, channels=names)
    assert passes(make(own, out, variants=("nominal", "matt"))) == (3, 0, 3, 3, 0)
    changed = {path for path, digest in digests(out).items() if before[path] != digest}
    assert {path.rsplit("/", 1)[0] for path in changed} <= {"image/nominal", "radiance/nominal"}
    assert len(renders & {path.name for path in cached(out)}) == 3  # the matt ones; the others' old renders are gone
    assert len(cached(out)) == 6
    assert findings(spin_usd, out) == []


def test_what_auto_exposure_chose_is_recorded_of_a_shared_render(whole) -> None:
    for path, record in records(whole).items():
        assert ("auto_exposure" in record["provenance"]) == (path.parent.name == "noisy")
        if path.parent.name == "noisy":
            rgba, _ = read_image(whole / record["files"]["radiance"]["path"])
            light = rgba[..., :3].astype(float) @ [0.2126, 0.7152, 0.0722]
            exposure = 0.9 * np.pi / 1361  # of every camera that travels with spin_usd
            factor = record["provenance"]["auto_exposure"]
            assert factor * exposure * light.sum() / rgba[..., 3].sum() == pytest.approx(0.4, rel=1e-5)


def test_a_picture_from_a_shared_render_is_reproduced(whole, spin_usd) -> None:
    made = json.loads(spin_usd("reproduce", whole, "img000001", "--variant", "starry", "--json").stdout)
    assert len(made["files"]) == 5
    assert all(file["same"] for file in made["files"])


@pytest.mark.slow
def test_a_killed_run_resumes_to_the_same(stage, whole, tmp_path, spin_usd) -> None:
    """Killed where some passes are in the cache; test_render kills runs early too."""
    out, after = tmp_path / "dataset", 8
    options = ["--renderer", "raycast", "--samples", "2", "--frames", FRAMES, "--variants", ",".join(VARIANTS)]
    command = [sys.executable, "-m", "spin_usd.command_line", "render", stage, "--out", out, *options, "--radiance"]
    process = subprocess.Popen([*command, "--workers", "2"], stdout=subprocess.DEVNULL, start_new_session=True)
    while len(list((out / "records").glob("*/*.json"))) < after:
        assert process.poll() is None
        time.sleep(0.002)
    process.kill()
    assert process.wait(timeout=60) == -signal.SIGKILL
    again = make(stage, out, workers=2)
    assert again.reused >= after
    assert again.label_passes < 6
    assert digests(out) == digests(whole)
    assert {path.name for path in cached(out)} == {path.name for path in cached(whole)}
    assert findings(spin_usd, out) == []
