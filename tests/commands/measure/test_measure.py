"""`spin-usd measure` on a small real stage: what it finds, and that it outlives kills and crashes."""

import dataclasses
import json
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from typing import Any, Never

import pytest
from msgspec import structs

import spin_usd as spin_usd_api
from spin_usd.accuracy.measurement import Configuration
from spin_usd.accuracy.sweep import settings_to_measure
from spin_usd.commands.measure.calls import (
    COMPARE_LABELS,
    FIND_ERRORS,
    FIND_FIGURES,
    FIND_SKIPPED_WORK,
    OPEN_MEASURING,
    RENDER_DIGEST,
    FindErrors,
    FoundErrors,
    MakePairs,
    OpenMeasuring,
    RenderOnce,
)
from spin_usd.commands.measure.campaign import Campaign, PercentDone
from spin_usd.commands.measure.execution_task import ExecutionTask
from spin_usd.commands.measure.measured_pictures import time_limit
from spin_usd.commands.measure.options import MeasureOptions
from spin_usd.commands.measure.picture_task import EVERYTHING, PictureTask, SavingsTask
from spin_usd.commands.measure.processes import Processes, ProcessKind
from spin_usd.commands.measure.renders import RenderStore
from spin_usd.errors import InputError, StageError
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.processes.child import Child
from spin_usd.processes.processors import usable_cpus
from spin_usd.scene.effort import QUALITIES, Effort
from spin_usd.store.measurement_file import read_measurement
from tests.conftest import REPOSITORY, speedplus_camera

pytestmark = pytest.mark.children


RAYCAST = ProcessKind(renderer="raycast")
ONCE = RenderOnce(index=0, effort=Effort(samples=1), seed=5)
MARK_S = 4321.0  # seconds that no render of this test takes
PATIENCE_S = 120.0  # for twelve small renders
OPTIONS = ("--frames", "0:1", "--max-samples", 4, "--seeds", 2)


@pytest.fixture(scope="module")
def tiny_stage(tmp_path_factory, spin_usd):
    """Eight pictures of Tango at 80 x 50."""
    folder = tmp_path_factory.mktemp("tiny")
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=24)))
    poses = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
    spin_usd("author", "--poses", poses, "--target", "tango", "--camera", folder / "camera.json",
             "--out", folder / "stage")  # fmt: skip
    return folder / "stage" / "dataset.usda"


@pytest.fixture(scope="module")
def killed(tiny_stage):
    """The folder of a measurement that was killed in the middle, all of whose renders then say that they took
    MARK_S."""
    out = tiny_stage.parent / "measured"
    command = [sys.executable, "-m", "spin_usd.command_line", "measure", str(tiny_stage), *map(str, OPTIONS)]
    running = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    try:
        give_up = time.monotonic() + PATIENCE_S
        while len(list(out.glob("runs/*/*.json"))) < 12:
            assert running.poll() is None
            assert time.monotonic() < give_up, "the measurement makes no renders"
            time.sleep(0.02)
    finally:
        running.kill()
        running.wait()
    for path in out.glob("runs/*/*.json"):
        kept = json.loads(path.read_text())
        if "cost" in kept:
            path.write_text(json.dumps({**kept, "cost": {**kept["cost"], "cpu_s": MARK_S, "warm": True}}))
    return out


@pytest.fixture(scope="module")
def measured(killed, tiny_stage, spin_usd):
    """That measurement, finished by a second run."""
    printed = spin_usd("measure", tiny_stage, *OPTIONS)
    assert "blender samples=4" in printed.stdout
    return read_measurement(killed / "measure.json")


def figures(measurement, renderer="blender", **effort):
    setting = Configuration(renderer=renderer, effort=Effort(**effort))
    return next(each for each in measurement.figures if each.setting == setting)


@pytest.mark.slow
def test_a_killed_measurement_is_taken_up_where_it_stopped(measured, killed) -> None:
    """Renders that were there are not made again, and the files of a finished picture are removed."""
    assert any(each.cpu_s == MARK_S for each in measured.figures)
    assert any(each.cpu_s < 60 for each in measured.figures)
    assert list(killed.glob("runs/*/*.exr")) == []
    assert {path.name for path in killed.iterdir()} == {"measure.json", "measure.md", "measure.svg", "runs"}


@pytest.mark.slow
def test_all_settings_are_measured_on_the_picture(measured) -> None:
    walked = settings_to_measure(max_samples=4, several_lights=False, glossy=True, others=tuple(QUALITIES.values()))
    assert [each.setting for each in measured.figures] == walked
    assert measured.failures == ()
    assert [frame.name for frame in measured.frames] == ["img000001"]
    assert all(each.memory_bytes > 50e6 and each.wall_s > 0 for each in measured.figures)


@pytest.mark.slow
def test_the_reference_is_as_good_as_it_says(measured) -> None:
    (frame,) = measured.frames
    smallest = min(each.error for each in measured.figures)
    assert not frame.reference_capped
    assert frame.reference_error**2 <= measured.reference_share * smallest**2
    assert frame.reference_samples > 4


@pytest.mark.slow
def test_more_samples_are_nearer_to_the_reference_and_unbiased(measured) -> None:
    one, four = (figures(measured, samples=samples) for samples in (1, 4))
    assert four.error_dn < one.error_dn
    assert four.structure < one.structure
    assert four.bias_squared < four.variance


@pytest.mark.slow
def test_the_preview_is_biased_and_has_no_noise(measured) -> None:
    """One ray through each pixel's centre, in Lambert's light: what it lacks is no chance."""
    preview = figures(measured, renderer="raycast", samples=1)
    assert preview.variance == 0
    assert preview.bias_squared > 0.05


@pytest.mark.slow
def test_labels_and_execution_agree(measured) -> None:
    (labels,) = measured.labels
    assert labels.iou > 0.99
    assert labels.reprojection_px < 1e-3
    assert [each.same for each in measured.execution] == [True] * len(measured.execution)
    assert {each.crop for each in measured.execution} == {True, False}


@pytest.mark.slow
def test_what_is_left_out_changes_less_than_another_seed(measured) -> None:
    """And nothing at all where it is said to be the same bits."""
    assert {"light tree"} <= {each.what for each in measured.savings}
    for saving in measured.savings:
        assert 0 < saving.ratio_least <= saving.ratio_most
        assert saving.difference < saving.noise
        if saving.what == "light tree":
            assert saving.difference == 0


@pytest.mark.slow
def test_a_finished_measurement_is_there_without_a_render(measured, killed, tiny_stage, spin_usd) -> None:
    before = (killed / "measure.json").read_text()
    again = spin_usd("measure", tiny_stage, *OPTIONS, "--json", "--quiet")
    assert json.loads(again.stdout) == json.loads(before)
    assert (killed / "measure.json").read_text() == before


@pytest.mark.slow
def test_a_measurement_of_something_else_is_not_overwritten(measured, killed, tiny_stage, spin_usd) -> None:
    before = (killed / "measure.json").read_bytes()
    other = tiny_stage.with_name("other.usda")
    shutil.copy(tiny_stage, other)
    for asked in ((tiny_stage, "--variant", "dark"), (other, "--out", killed)):
        told = spin_usd("measure", *asked, *OPTIONS, "--quiet", code=2).stderr
        assert told.endswith(
            "contains a measurement of variant nominal of ../dataset.usda; give another folder with --out\n"
        )
    assert (killed / "measure.json").read_bytes() == before


def campaign(tmp_path, told=lambda *_: None, **fields):
    request = MeasureOptions(tmp_path / "dataset.usda")
    usual = {
        "request": request,
        "runs": RenderStore(root=tmp_path, work=tmp_path / "work"),
        "seed": 7,
        "stage": "0" * 64,
        "versions": {"bpy": "5.2.3"},
        "machine": {"cores": 2},
        "percent_done": PercentDone(told),
        "processes": None,
    }
    return Campaign(**{**usual, **fields})


def planned(**fields):
    usual = {field.name: None for field in dataclasses.fields(PlannedPicture)}
    content = {
        "radiance": "r",
        "exposure": "e",
        "frame": "f",
        "region": (0, 0, 10, 10),
        "light_groups": 1,
        "features": (),
    }
    return PlannedPicture(**{**usual, **content, **fields})


def test_a_render_is_known_by_all_that_decides_it(tmp_path) -> None:
    """So a changed stage, setting, seed, renderer, software or machine is measured anew, and nothing else is."""

    def keys(picture=None, kind=RAYCAST, effort=None, seeds=(1, 2), **shared):
        how = (picture or planned(), kind, effort or Effort(), seeds)
        return campaign(tmp_path, **shared).series(*how).keys

    others = [
        keys(planned(radiance="other")),
        keys(kind=ProcessKind(renderer="blender")),
        keys(kind=ProcessKind(renderer="raycast", crop=False)),
        keys(effort=Effort(samples=17)),
        keys(seeds=(3, 4)),
        keys(versions={"bpy": "5.2.4"}),
        keys(machine={"cores": 4}),
    ]
    every = [*keys(), *(key for each in others for key in each)]
    assert len(set(every)) == len(every)
    assert keys() == keys(planned(exposure="brighter"))


def test_figures_are_known_by_their_formulas_too_and_renders_are_not(tmp_path, monkeypatch) -> None:
    """So what an earlier version worked out is worked out anew, from the renders that it made."""

    def keys():
        shared = campaign(tmp_path)
        picture, execution = PictureTask(shared, planned()), ExecutionTask(shared, [planned()])
        return {picture.key, *execution.keys}, picture.keys - {picture.key}

    results, renders = keys()
    monkeypatch.setattr("spin_usd.commands.measure.campaign.FORMULAS", 99)
    assert results.isdisjoint(keys()[0])
    assert renders == keys()[1]


def test_figures_are_of_a_picture_in_its_place(tmp_path) -> None:
    """Which they hold: a picture that stands elsewhere in the stage now has others."""
    one, other = (PictureTask(campaign(tmp_path), planned(index=index)) for index in (0, 1))
    assert one.key != other.key
    assert one.keys - {one.key} == other.keys - {other.key}


class Answering:
    """Processes that have these answers, by call."""

    def __init__(self, answers) -> None:
        self.answers = answers
        self.requests: list[Any] = []

    def run(self, kind, call, requests, on_made=None):
        self.requests += requests
        return [self.answers.get(call) for _ in requests]


def test_a_picture_that_has_no_figures_is_a_failure_and_no_frame(tmp_path) -> None:
    """The rest of the measurement goes on."""
    processes = Answering(
        {
            FIND_ERRORS: FoundErrors(reference=0.0, settings=[0.0]),
            FIND_FIGURES: InputError("it is too small"),
            FIND_SKIPPED_WORK: [],
        }
    )
    found = PictureTask(campaign(tmp_path), planned(), savings=True).measured(processes)
    assert [(each.frame, each.what, each.reason) for each in found.failures] == [("f", "figures", "it is too small")]
    assert (found.frames, found.figures, found.savings) == ((), (), ())


def test_seeds_are_neither_those_of_pictures_nor_of_the_reference(tmp_path) -> None:
    """The choice among settings is not made on the pictures themselves."""
    settings, reference = (campaign(tmp_path).seeds(purpose, range(100)) for purpose in ("setting", "reference"))
    assert len({7, *settings, *reference}) == 201
    assert campaign(tmp_path, seed=8).seeds("setting", range(100)) != settings


def test_what_is_left_out_is_measured_by_itself_and_all_together(tmp_path) -> None:
    """In pairs, each in a job of its own; and where one is left out, all of it is that."""
    for names, wanted in (
        (["light tree", "camera shader"], ["light tree", "camera shader", EVERYTHING]),
        (["light tree"], ["light tree"]),
        ([], []),
    ):
        processes, shared = Answering({FIND_SKIPPED_WORK: names}), campaign(tmp_path)
        saving = SavingsTask(shared, planned())
        saving.render(processes)
        assert len(saving.keys) == 2 * shared.request.seeds * len(wanted)
        made = [each for each in processes.requests if isinstance(each, MakePairs)]
        assert [each.work for each in made] == [[what] if what != EVERYTHING else names for what in wanted]


def test_work_is_told_of_once() -> None:
    heard = []
    percent_done = PercentDone(lambda what, done, total: heard.append((done, total)))
    percent_done.expect({"a": 30, "b": 60})
    percent_done.expect({"a": 30, "c": 10})
    percent_done.did(["a", "a", "unknown"])
    percent_done.did(["b", "a"])
    percent_done.did(["c"])
    assert heard == [(0, 100), (0, 100), (30, 100), (90, 100), (100, 100)]


@pytest.mark.parametrize(
    "asked",
    [
        {"count": 0},
        {"count": 101},
        {"seeds": 1},
        {"seeds": 65},
        {"max_samples": 0},
        {"reference_samples": 63},
        {"reference_share": 0.0},
        {"reference_share": float("nan")},
        {"variant": "all"},
    ],
)
def test_a_request_that_makes_no_sense_is_refused(tmp_path, asked) -> None:
    with pytest.raises(InputError):
        MeasureOptions(tmp_path, **asked)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"variant": "nothing"}, "nominal"),
        ({"frames": "90:"}, "selects none"),
    ],
)
def test_what_cannot_be_measured_is_refused_and_leaves_nothing(small_stage, tmp_path, asked, said) -> None:
    with pytest.raises(InputError, match=said):
        spin_usd_api.measure(small_stage, out=tmp_path / "out", **asked)
    assert not (tmp_path / "out").exists()


def test_a_folder_of_something_else_is_left_alone(small_stage, tmp_path, spin_usd) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    told = spin_usd("measure", small_stage, "--out", tmp_path, "--quiet", code=2).stderr
    assert "notes.txt" in told
    assert len(told.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("name", ["measure.md", "runs/notes.txt", "measure.tmp-1.json", ".work/x", ".lock"])
def test_a_folder_that_is_no_measurement_is_refused(small_stage, tmp_path, name) -> None:
    path = tmp_path / "out" / name
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    with pytest.raises(InputError, match="not part of a measurement"):
        spin_usd_api.measure(small_stage, out=tmp_path / "out")
    assert [each for each in (tmp_path / "out").rglob("*") if each.is_file()] == [path]


class Dying(Child):
    """Is killed when it gets to compare labels."""

    def send(self, call, request) -> None:
        dies = call is COMPARE_LABELS
        if dies:
            self.process.send_signal(signal.SIGSTOP)  # else it may answer first
        super().send(call, request)
        if dies:
            self.process.kill()


@pytest.fixture
def opened(small_stage, tmp_path):
    """Starts a process that measures, of the class given."""

    def start(kind_of_child, kind, number, variant="nominal"):
        child = kind_of_child()
        opening = OpenMeasuring(
            stage=str(small_stage),
            variant=variant,
            folder=str(tmp_path),
            work=str(tmp_path / "work"),
            cpus=usable_cpus(),
            **vars(kind),
        )
        child.send(OPEN_MEASURING, opening)
        return child

    return start


@pytest.mark.slow
def test_a_crash_ends_one_job(opened) -> None:
    wrong = FindErrors(index=0, reference=["a", "b"], runs=[])
    with Processes(1, partial(opened, Dying), within_s=60.0) as processes:
        (first,) = processes.run(RAYCAST, RENDER_DIGEST, [ONCE])
        (crashed,) = processes.run(RAYCAST, COMPARE_LABELS, [0])
        (refused,) = processes.run(RAYCAST, FIND_ERRORS, [wrong])
        (last,) = processes.run(RAYCAST, RENDER_DIGEST, [ONCE])
    assert isinstance(first, str)
    assert first == last
    assert "SIGKILL" in str(crashed)
    assert "is damaged or replaced" in str(refused)


def test_a_process_that_says_nothing_for_too_long_is_ended(opened) -> None:
    """After it was heard of, which is when it has opened."""
    endless = structs.replace(ONCE, effort=Effort(samples=10**6))
    with Processes(1, partial(opened, Child), within_s=60.0) as processes:
        assert isinstance(processes.run(RAYCAST, RENDER_DIGEST, [ONCE])[0], str)
        processes.within_s = 0.2
        (answer,) = processes.run(RAYCAST, RENDER_DIGEST, [endless])
    assert "of processor time, more than its limit of 0.2 s" in str(answer)


def test_the_time_limit_grows_with_the_samples() -> None:
    pixels = 1000 * 1000
    picture = planned(region=(0, 0, 1000, 1000), target_pixels=pixels, features=())
    few, many = (
        time_limit([picture], max_samples=samples, frame_pixels=1920 * 1200, workers=1, cores=1)
        for samples in (1, 1 << 14)
    )
    assert few < many


def test_where_no_process_opens_it_is_said(opened) -> None:
    with (
        Processes(1, partial(opened, Child, variant="nothing"), within_s=60.0) as processes,
        pytest.raises(StageError, match="nothing"),
    ):
        processes.run(RAYCAST, COMPARE_LABELS, [0])


def test_several_processes_share_the_jobs(opened) -> None:
    requests = [structs.replace(ONCE, seed=seed) for seed in (5, 6, 5)]
    with Processes(2, partial(opened, Child), within_s=60.0) as processes:
        answers = processes.run(RAYCAST, RENDER_DIGEST, requests)
    assert all(isinstance(each, str) for each in answers)
    assert answers[0] == answers[2]


def test_what_a_measurement_will_not_serve_for_is_told_before_anything_is_rendered(tmp_path, spin_usd) -> None:
    """The detector of an ideal camera has no noise; the run is ended where that is said."""
    poses = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
    given = ("--poses", poses, "--camera", "speedplus", "--target", "tango", "--preset", "ideal")
    spin_usd("author", *given, "--out", tmp_path / "stage")

    class ToldError(Exception):
        pass

    def stop(note) -> Never:
        raise ToldError(note)

    with pytest.raises(ToldError, match=r"has no noise \(spin:sensor:gain is 0\), so --error auto"):
        spin_usd_api.measure(tmp_path / "stage" / "dataset.usda", out=tmp_path / "out", on_note=stop)
