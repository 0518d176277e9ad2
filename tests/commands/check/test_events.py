"""Events of a dataset: what is wrong with a file, its record or its pixels is found, and nothing else."""

import json
import shutil

import numpy as np
import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.commands.check.dataset import dataset_findings
from spin_usd.commands.check.in_child.events import HOT_RATE, hot_pixels
from spin_usd.commands.check.repair import repair
from spin_usd.files.folder import Folder
from spin_usd.files.sha256 import sha256_of
from spin_usd.store.read_documents import read_dataset_json
from tests.cases.events import DURATION_US, START_US, make_events, put_events

FILE, RECORD = "events/nominal.h5", "events/nominal.json"
COUNT = 5000


@pytest.fixture
def dataset(rendered, tmp_path):
    folder = shutil.copytree(rendered, tmp_path / "dataset")
    put_events(folder, make_events(COUNT))
    return folder


def found(dataset):
    return [
        (each.code, each.where, each.severity)
        for each in dataset_findings(dataset, progress=no_progress)
        if each.where.startswith(("events", "cache"))
    ]


def test_events_that_were_just_made_have_no_finding(dataset) -> None:
    assert found(dataset) == []


def test_a_damaged_or_lost_file_is_named_and_left(dataset) -> None:
    path = dataset / FILE
    content = path.read_bytes()
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    assert found(dataset) == [("sha256", FILE, "error")]
    report = repair(dataset, progress=no_progress)
    assert report.unrepaired
    (said,) = report.unrepaired
    assert said.startswith(f"{FILE}: differs from its record; remove the events' record, and run spin-usd render again")
    assert path.is_file()
    path.unlink()
    assert found(dataset) == [("missing", FILE, "error")]


def test_a_file_that_is_no_event_file_is_one_finding(dataset) -> None:
    (dataset / FILE).write_bytes(b"no HDF5")
    record = json.loads((dataset / RECORD).read_text())
    (dataset / RECORD).write_text(json.dumps({**record, "sha256": sha256_of(dataset / FILE)}))
    assert found(dataset) == [("unreadable", FILE, "error")]


def test_what_is_in_no_record_and_what_a_killed_run_left_are_named(dataset) -> None:
    (dataset / RECORD).unlink()
    (dataset / "cache/events/0").mkdir(parents=True)
    (dataset / "cache/events/0/events-000000.npz").write_bytes(b"")
    assert found(dataset) == [("cache", "cache/events/0/events-000000.npz", "warning"), ("stray", FILE, "warning")]


@pytest.mark.parametrize(
    ("said", "finding"),
    [
        ({"events": COUNT - 1}, ("events", FILE, "error")),
        ({"start": 4.0}, ("events", FILE, "error")),
        ({"duration": 1.0}, ("events", FILE, "error")),
        ({"file": "events/other.h5"}, ("record", RECORD, "error")),
        ({"steps": "many"}, ("record", RECORD, "error")),
        ({"stage": "0" * 64}, ("outdated", FILE, "warning")),
    ],
)
def test_a_record_of_other_events_is_found(dataset, said, finding) -> None:
    put_events(dataset, make_events(COUNT), **said)
    assert found(dataset) == [finding]


def test_late_events_are_found_where_latency_does_not_explain_them(dataset) -> None:
    events = make_events(COUNT)
    events["t"][-1] = START_US + DURATION_US + 100 + 10 * 30
    put_events(dataset, events)
    assert found(dataset) == []
    events["t"][-1] += 10
    put_events(dataset, events)
    assert found(dataset) == [("events", FILE, "error")]


def test_labels_are_those_of_the_dataset(dataset) -> None:
    description = read_dataset_json(Folder(dataset))
    events = make_events(COUNT, labelled=True)
    parts = np.array([0, *map(int, description.parts)])
    events["part"] = np.resize(parts, COUNT)
    events["target"] = [0 if not part else description.parts[str(part)].target for part in events["part"].tolist()]
    put_events(dataset, events, labelled=True)
    assert found(dataset) == []
    events["target"][7] += 1
    put_events(dataset, events, labelled=True)
    assert found(dataset) == [("events", FILE, "error")]


def test_no_event_is_worth_a_word(dataset) -> None:
    put_events(dataset, make_events(0))
    assert found(dataset) == [("event-rate", FILE, "warning")]


def test_a_hot_pixel_is_told_from_a_small_bright_target_and_from_noise(dataset) -> None:
    counts = np.random.default_rng(0).poisson(20, (200, 320))
    assert hot_pixels(counts, 1.0) == []
    counts[50:56, 60:66] = 9000  # less than a thousandth of all pixels
    assert hot_pixels(counts, 1.0) == []
    counts[120, 200] = HOT_RATE
    assert hot_pixels(counts, 1.0) == []
    counts[[120, 0], [200, 319]] = 9000
    assert hot_pixels(counts, 1.0) == [(319, 0), (200, 120)]
    events = make_events(3 * COUNT)
    events["x"][: 2 * COUNT], events["y"][: 2 * COUNT] = 3, 5
    put_events(dataset, events)
    assert found(dataset) == [("hot-pixels", FILE, "warning")]
