"""The functions do what the commands do, report how far they are, and raise what a command would say."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import spin_usd
from spin_usd.commands.plan.report import PlanReport
from spin_usd.commands.render.report import RenderReport
from tests.conftest import REPOSITORY, speedplus_camera

POSES = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"


class Heard(list[tuple[str, int, int]]):
    """Takes progress."""

    def __call__(self, subject: str, done: int, total: int) -> None:
        self.append((subject, done, total))

    def assert_finished(self, total: int) -> None:
        assert self[-1][1:] == (total, total)
        assert all(0 <= done <= of for _, done, of in self)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Has an authored stage and a rendered dataset of it."""
    made = tmp_path_factory.mktemp("api")
    (made / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    report = spin_usd.author(
        poses=POSES,
        target="tango",
        camera=made / "camera.json",
        out=made / "stage",
        frames="0:2",
        sun_direction=(0, 0, -2),
    )
    assert (report.root, report.frames, report.target) == (str(made / "stage" / "dataset.usda"), 2, "tango")
    return made


@pytest.fixture(scope="module")
def heard() -> Heard:
    return Heard()


@pytest.fixture(scope="module")
def rendered(folder: Path, heard: Heard) -> RenderReport:
    return spin_usd.render(
        str(folder / "stage"), out=folder / "dataset", renderer="raycast", labels=["depth", "range"], on_progress=heard
    )


def test_rendering_reports_what_it_made_and_how_far_it_is(folder: Path, rendered: RenderReport, heard: Heard) -> None:
    assert (rendered.pictures, rendered.made, rendered.failed) == (2, 2, [])
    heard.assert_finished(2)
    assert set(spin_usd.Dataset(folder / "dataset")[0].files) == {"image", "depth", "range"}


def test_a_plan_knows_what_is_there_already(folder: Path, rendered: RenderReport) -> None:
    again: PlanReport = spin_usd.plan(folder / "stage", out=folder / "dataset", renderer="raycast", labels="depth")
    assert again.cost.finished == again.pictures["nominal"] == 2


def test_a_check_finds_nothing_wrong(folder: Path, rendered: RenderReport) -> None:
    heard = Heard()
    checked = spin_usd.check(folder / "dataset", on_progress=heard)
    assert (checked.kind, list(checked.findings)) == ("dataset", [])
    heard.assert_finished(2)


def test_a_picture_is_reproduced_to_the_byte(folder: Path, rendered: RenderReport) -> None:
    made = spin_usd.reproduce(folder / "dataset", "img000001")
    assert made.same
    assert {file.kind for file in made.files} == {"image", "depth", "range"}


def test_augmentations_become_variants(folder: Path, tmp_path: Path) -> None:
    spec = tmp_path / "few.toml"
    spec.write_text('schema = "augment-1"\nseed = 1\n[[augmentation]]\nname = "dim"\nselect = { camera = "rich" }\n')
    report = spin_usd.augment(folder / "stage", spec=spec, out=folder / "stage" / "more.usda")
    assert report.augmentations == ("dim",)
    planned = spin_usd.plan(report.root, variants=["nominal", "dim"], renderer="raycast")
    assert planned.pictures == {"nominal": 2, "dim": 2}


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: spin_usd.author(out="x"), "neither poses, sample nor scenario is given"),
        (lambda: spin_usd.author(out="x", poses="gone.json", target="tango", camera="speedplus"), "gone.json"),
        (lambda: spin_usd.render("gone.usda", out="x"), "gone.usda: does not exist; check the path"),
        (
            lambda: spin_usd.render("gone.usda", out="x", samples=1, error=0.1),
            "samples and error are given together",
        ),
        (lambda: spin_usd.plan("gone.usda", labels=["colour"]), "there is no label 'colour'"),
        (lambda: spin_usd.check("gone"), "does not exist"),
        (lambda: spin_usd.measure("gone.usda", seeds=1), "seeds is 1"),
        (lambda: spin_usd.reproduce("gone", "img000001"), "is not a dataset"),
        (lambda: spin_usd.Dataset("gone"), "is not a dataset"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_cannot_be_done_is_a_spin_error(
    call: Callable[[], object], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(spin_usd.SpinError, match=sentence):
        call()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("workers", [-2, 0, 1025])
@pytest.mark.parametrize("function", [spin_usd.render, spin_usd.measure])
def test_a_number_of_workers_that_cannot_be_started_is_refused(
    function: Callable[..., object], workers: int, folder: Path, tmp_path: Path
) -> None:
    with pytest.raises(spin_usd.SpinError, match=f"workers is {workers}; make it 1 to 1024"):
        function(folder / "stage", out=tmp_path / "out", workers=workers)
    assert not list(tmp_path.iterdir())


def test_numpy_s_numbers_are_numbers(folder: Path) -> None:
    planned = spin_usd.plan(folder / "stage", samples=np.int64(2), seed=np.int32(4), labels_only=np.bool_(True))
    assert planned.pictures == {"nominal": 2}
