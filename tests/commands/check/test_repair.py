"""check --repair: what is damaged or lost is made again, to the byte, and nothing of the user's is touched."""

import json
import shutil

import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.commands.check.damage import listed_again
from spin_usd.commands.check.recorded_requests import valid_records
from spin_usd.commands.check.repair import repair
from spin_usd.commands.render.run import render_dataset
from spin_usd.errors import InputError
from spin_usd.options import RunOptions
from spin_usd.scene.effort import Effort
from spin_usd.store.dataset_folder import Store
from tests.cases.requests import request_for

FRAMES = 3


@pytest.fixture(scope="module")
def whole(small_stage, tmp_path_factory):
    """A dataset whose last picture was made with another effort than the others."""
    out = tmp_path_factory.mktemp("whole") / "dataset"
    for frames, samples in ((f"0:{FRAMES}", 2), (f"{FRAMES - 1}:{FRAMES}", 3)):
        request = request_for(
            small_stage, renderer="raycast", frames=frames, effort=Effort(samples=samples), labels=("depth",)
        )
        assert not render_dataset(request, out, RunOptions(workers=1), progress=no_progress).failed
    return out


@pytest.fixture
def dataset(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "dataset", symlinks=True)


def contents(folder):
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != "measured.json")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def flip(path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.slow
def test_what_is_damaged_or_lost_is_made_again_to_the_byte(whole, dataset, spin_usd) -> None:
    """Of every kind at once: a flipped byte, a lost file, a lost record, and dataset.json, whose rest can be read."""
    flip(dataset / "image" / "nominal" / "img000001.png")
    (dataset / "records" / "nominal" / "img000002.json").unlink()
    (dataset / "depth" / "nominal" / "img000003.exr").unlink()
    (dataset / "dataset.json").write_text('{"schema": "dataset-1"')
    done = spin_usd("check", dataset, "--repair")
    mended = ("dataset.json", *(f"nominal/img00000{n}" for n in (1, 2, 3)))
    assert {f"repaired: {what}" for what in mended} == set(done.stdout.splitlines()[:-1])
    assert contents(dataset) == contents(whole)
    assert repair(dataset, progress=no_progress).repaired == []


@pytest.mark.slow
def test_a_record_that_lies_and_a_damaged_render_are_made_again(whole, dataset) -> None:
    record = dataset / "records" / "nominal" / "img000001.json"
    value = json.loads(record.read_text())
    value["pose"]["t_cam_body"][0] += 1e-3
    record.write_text(json.dumps(value))
    used = json.loads((dataset / "records" / "nominal" / "img000003.json").read_text())["provenance"]["keys"][
        "radiance"
    ]
    (entry,) = (dataset / "cache" / "renders").rglob(f"{used}.*")
    flip(entry)
    report = repair(dataset, progress=no_progress)
    assert (report.repaired, report.unrepaired) == (["nominal/img000001", "nominal/img000003"], [])
    assert report.findings == []
    assert contents(dataset) == contents(whole)


def test_what_is_the_users_stays_and_what_cannot_be_made_is_said(dataset, spin_usd) -> None:
    """A layer of the stage is in no other place; a stray file need not be a picture's."""
    mine = [dataset / "notes.txt", dataset / "image" / "nominal" / "mine.png", dataset / ".work-mine" / "x"]
    for path in mine:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    layer = dataset / "stage" / "layers" / "lights.usda"
    layer.write_text(layer.read_text().replace("distantLight", "nothing")[:-20])
    flip(dataset / "image" / "nominal" / "img000001.png")
    done = spin_usd("check", dataset, "--repair", "--json", code=1)
    report = json.loads(done.stdout)
    assert report["repaired"] == []
    assert any("img000001" in what for what in report["unrepaired"])
    assert [path.read_text() for path in mine] == ["mine"] * 3


@pytest.mark.slow
def test_the_list_of_the_stages_files_comes_back_where_records_vouch_for_each(dataset, small_stage) -> None:
    """Layers of looks that no picture has could be edited: then who replaces the stage must be told. It comes back with
    the stage itself too."""
    sums = dataset / "stage" / "SHA256SUMS"
    sums.unlink()
    (unsure,) = list(repair(dataset, progress=no_progress).unrepaired or ())
    said = (
        "stage/SHA256SUMS: cannot be written again: no record confirms that stage/layers/variant_sets/plain.usda is as"
    )
    assert unsure.startswith(said)
    assert not sums.exists()
    request = request_for(small_stage, renderer="raycast", frames="0:1", effort=Effort(samples=2), labels=("depth",))
    assert render_dataset(request, dataset, RunOptions(workers=1), progress=no_progress).made == 0
    assert "plain.usda" in sums.read_text()
    sums.unlink()
    record = json.loads((dataset / "records" / "nominal" / "img000001.json").read_text())
    used = {dataset / "stage" / layer for layer in record["provenance"]["stage"]["files"]}
    for layer in (path for path in (dataset / "stage").rglob("*") if path.is_file() and path not in used):
        layer.unlink()
    assert repair(dataset, progress=no_progress).repaired == ["stage/SHA256SUMS"]
    assert "dataset.usda" in sums.read_text()


def test_nothing_is_made_again_of_an_altered_stage(dataset) -> None:
    """Its pictures would be others, and their records would say that all is well."""
    layer = next(iter(sorted((dataset / "stage" / "layers").rglob("*light*.usda"))))
    layer.write_text(layer.read_text() + "# altered\n")
    images = sorted((dataset / "image").rglob("*.png"))
    for image in images:
        flip(image)
    before = contents(dataset)
    report = repair(dataset, progress=no_progress)
    assert report.repaired == []
    (said,) = list(report.unrepaired or ())
    assert f"{layer.relative_to(dataset)} is not the layer that made them" in said
    assert contents(dataset) == before
    assert {finding.where for finding in report.findings} >= {str(image.relative_to(dataset)) for image in images}


@pytest.mark.slow
def test_a_link_keeps_its_own_pictures_alone_from_being_repaired(whole, dataset) -> None:
    """It stays, and what it leads to; beside it a list that is junk is written again, but for what nobody vouches."""
    mine = dataset.parent / "mine.png"
    mine.write_text("mine")
    linked, other = (dataset / f"image/nominal/img00000{number}.png" for number in (1, 2))
    linked.unlink()
    linked.symlink_to(mine)
    flip(other)
    (dataset / "stage" / "SHA256SUMS").write_text("junk")
    report = repair(dataset, progress=no_progress)
    assert report.repaired == ["nominal/img000002"]
    of_link, of_list = list(report.unrepaired or ())
    assert of_link.startswith("nominal/img000001: ")
    assert "img000001.png: is a link" in of_link
    assert "plain.usda is as it was" in of_list
    assert [finding.where for finding in report.findings] == ["image/nominal/img000001.png", "stage/SHA256SUMS"]
    assert (linked.is_symlink(), mine.read_text()) == (True, "mine")
    assert other.read_bytes() == (whole / "image/nominal/img000002.png").read_bytes()


def test_a_damaged_list_is_written_again_where_its_lines_and_records_vouch_for_all(whole, dataset) -> None:
    sums = dataset / "stage" / "SHA256SUMS"
    lines = sums.read_text().splitlines()
    sums.write_text("\n".join("junk" if line.endswith("dataset.usda") else line for line in lines))
    store = Store(root=dataset)
    assert list(listed_again(store, valid_records(store))) == ["stage/SHA256SUMS"]
    assert contents(dataset) == contents(whole)


def test_a_description_that_cannot_be_made_again_stays(dataset) -> None:
    """Here the stage that it would be read from is gone."""
    (dataset / "dataset.json").write_text("{")
    shutil.rmtree(dataset / "stage")
    (said,) = list(repair(dataset, progress=no_progress).unrepaired or ())
    assert said.startswith("dataset.json: ")
    assert (dataset / "dataset.json").read_text() == "{"


def test_what_is_not_a_dataset_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="is not a dataset"):
        repair(tmp_path, progress=no_progress)
