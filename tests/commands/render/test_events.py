"""`render --events`: the same bytes by any number of workers and after kills, or a sentence on why there are none."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from spin_usd import Dataset, plan, render
from spin_usd.errors import InputError
from spin_usd.processes.child import IN_PROCESS
from spin_usd.store.names import EVENTS, STATE
from tests.cases.moving import author_moving

OPTIONS = {"renderer": "raycast", "samples": 4, "labels": "none", "events": True}
EXPOSED = """schema = "augment-1"
[[augmentation]]
name = "exposed"
[augmentation.sample]
"exposure.stops" = { distribution = "uniform", low = -1.5, high = 1.5, unit = "stops", per = "frame" }
"""
COMMAND = (sys.executable, "-m", "spin_usd.command_line", "render")


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    return author_moving(tmp_path_factory.mktemp("stage") / "moving", sensor="v2e_noisy", rate=60, resolution="64")


@pytest.fixture(scope="module")
def made(stage, tmp_path_factory):
    out = tmp_path_factory.mktemp("events") / "set"
    report = render(stage, out=out, event_labels=True, **OPTIONS)
    assert report.events == 1
    return out


def test_a_dataset_has_its_events_and_what_they_were_made_by(made) -> None:
    dataset, record = Dataset(made), json.loads((made / "events/nominal.json").read_text())
    events = dataset.events()
    assert (events.start, events.duration) == (0.0, 2.0)
    assert (events.width, events.height) == (64, 40)
    assert len(events) == record["events"] > 100
    assert record["renders"] < record["steps"]
    assert record["sensor"]["cutoff"] == 30
    found = events.between(0, 3)
    assert (np.diff(found["t"]) >= 0).all()
    assert set(np.unique(found["target"])) == {0, 1}  # noise is of nothing
    for picture in dataset:
        np.testing.assert_allclose(events.pose(picture.time_s), picture.T_cam_body, atol=1e-9)
    assert not list((made / "cache").glob(f"{EVENTS}/*"))


def test_the_same_again_makes_nothing(made, stage) -> None:
    before = (made / "events/nominal.h5").stat().st_mtime_ns
    render(stage, out=made, event_labels=True, **OPTIONS)
    assert (made / "events/nominal.h5").stat().st_mtime_ns == before


def test_a_damaged_file_is_made_again_and_nothing_else_stays_in_the_cache(made, stage, tmp_path) -> None:
    shutil.copytree(made, tmp_path / "set")
    file = tmp_path / "set/events/nominal.h5"
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + b"x")
    (tmp_path / "set/cache/events/of_before").mkdir(parents=True)
    render(stage, out=tmp_path / "set", event_labels=True, **OPTIONS)
    assert file.read_bytes() == whole
    assert not (tmp_path / "set/cache/events").exists()


@pytest.mark.children
@pytest.mark.parametrize("workers", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_any_number_of_workers_makes_the_same_bytes(made, stage, tmp_path, workers) -> None:
    render(stage, out=tmp_path / "set", event_labels=True, workers=workers, **OPTIONS)
    for name in ("nominal.h5", "nominal.json"):
        assert (tmp_path / "set/events" / name).read_bytes() == (made / "events" / name).read_bytes()


@pytest.fixture(scope="module")
def killed(stage, tmp_path_factory):
    """What a run left that was killed after its first chunk of events."""
    out = tmp_path_factory.mktemp("killed") / "set"
    process = start(stage, out)
    while process.poll() is None and not list(out.glob(f"cache/{EVENTS}/*/{STATE}-000001.npz")):
        time.sleep(0.01)
    assert process.poll() is None
    process.send_signal(signal.SIGKILL)
    process.wait()
    return out


def start(stage, out):
    """Start a run of two workers, as a user's."""
    options = ("--renderer", "raycast", "--samples", "4", "--labels", "none", "--events", "--event-labels")
    command = [*COMMAND, str(stage), "--out", str(out), *options, "--workers", "2"]
    environment = {name: value for name, value in os.environ.items() if name != IN_PROCESS}
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment)


def left_by(killed, folder):
    """A copy of what the killed run left, whose lock nobody holds."""
    return shutil.copytree(killed, folder, ignore=shutil.ignore_patterns(".work-*"))


def test_a_run_that_is_killed_goes_on_and_makes_the_same_bytes(made, stage, killed, tmp_path) -> None:
    out = left_by(killed, tmp_path / "set")
    (first, *_) = sorted(out.glob(f"cache/{EVENTS}/*/{EVENTS}-*"))
    was = first.stat().st_mtime_ns
    again = start(stage, out)
    while again.poll() is None and first.exists():
        assert first.stat().st_mtime_ns == was if first.exists() else True
        time.sleep(0.02)
    assert again.wait() == 0, again.stderr.read()
    assert (out / "events/nominal.h5").read_bytes() == (made / "events/nominal.h5").read_bytes()


@pytest.mark.parametrize("what", [EVENTS, STATE])
def test_a_chunk_that_is_damaged_is_made_again(made, stage, killed, tmp_path, what) -> None:
    """As a power cut in the middle of a run leaves it."""
    out = left_by(killed, tmp_path / "set")
    (first, *_) = sorted(out.glob(f"cache/{EVENTS}/*/{what}-*"))
    os.truncate(first, 50)
    render(stage, out=out, event_labels=True, **OPTIONS)
    assert (out / "events/nominal.h5").read_bytes() == (made / "events/nominal.h5").read_bytes()


@pytest.mark.parametrize("text", ["", "[]", '{"schema": "events-1"}'])
def test_a_damaged_record_is_made_again(made, stage, tmp_path, text) -> None:
    shutil.copytree(made, tmp_path / "set")
    (tmp_path / "set/events/nominal.json").write_text(text)
    render(stage, out=tmp_path / "set", event_labels=True, **OPTIONS)
    for name in ("nominal.h5", "nominal.json"):
        assert (tmp_path / "set/events" / name).read_bytes() == (made / "events" / name).read_bytes()


def test_exposures_of_pictures_make_no_events(tmp_path) -> None:
    spec = tmp_path / "exposed.toml"
    spec.write_text(EXPOSED)
    still = author_moving(tmp_path / "still", rate=0, speed=0, resolution="64", augment=spec)
    render(still, out=tmp_path / "set", variants=("exposed",), **OPTIONS)
    assert len({picture.record["appearance"]["exposure"] for picture in Dataset(tmp_path / "set")}) > 1
    assert not len(Dataset(tmp_path / "set").events())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"event_labels": True, "events": False}, "event_labels is given without events"),
        ({"shard": "0/2"}, "with a shard, a cluster or a URL"),
        ({"frames": "0:1"}, "there is only one"),
    ],
)
def test_what_does_not_go_together_is_refused(stage, tmp_path, options, said) -> None:
    with pytest.raises(InputError, match=said):
        render(stage, out=tmp_path / "set", **{**OPTIONS, **options})


def test_a_stage_without_an_event_camera_or_without_times_is_refused(small_stage, tmp_path) -> None:
    with pytest.raises(InputError, match="the times of its pictures"):
        render(small_stage, out=tmp_path / "set", **OPTIONS)
    plain = author_moving(tmp_path / "plain", sensor=None)
    with pytest.raises(InputError, match="has no event camera"):
        render(plain, out=tmp_path / "other", **OPTIONS)


def test_the_plan_says_how_many_renders_it_takes(made, stage) -> None:
    (said,) = [note for note in plan(stage, events=True, renderer="raycast").notes if "events of nominal" in note]
    record = json.loads((made / "events/nominal.json").read_text())
    assert f"take {record['steps']} time steps in 2 s" in said
    least, most = map(int, re.search(r"(\d+) to (\d+) are rendered", said).groups())
    assert least <= record["renders"] <= most == record["steps"]


@pytest.mark.parametrize(
    "how",
    [
        {"start": 0.0, "speed": 0.6, "distance": 1.5, "resolution": "32"},  # it leaves the frame
        pytest.param({"start": -5.0, "speed": 5.0, "distance": 60.0}, marks=pytest.mark.slow),  # half a pixel
        {"start": 3.0, "speed": 0.0},  # it is never in it
    ],
)
def test_targets_that_leave_or_are_tiny_or_are_not_there(tmp_path, how) -> None:
    stage = author_moving(tmp_path / "moving", **{"resolution": "64", **how})
    render(stage, out=tmp_path / "set", **OPTIONS)
    events = Dataset(tmp_path / "set").events()
    assert (len(events) > 20) == bool(how["speed"])
