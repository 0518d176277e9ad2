"""Events of the page: windows of time after a picture, painted where they are."""

import base64
import json
import shutil
import zlib

import numpy as np
import pytest

import spin_usd
from spin_usd.commands.show.in_child import EVENT_WINDOW_S, EVENT_WINDOWS, event_file
from spin_usd.files.folder import FileIn, Folder
from spin_usd.reading.events import EventStream
from tests.cases.events import START_US, make_events, put_events, write_events

PAINTED = (
    "c => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
    " return Array.from({ length: d.length / 4 }, (_, i) => d[4 * i + 3] ? (d[4 * i] > 128 ? 1 : -1) : 0); }"
)


def balance(events, window):
    """Which sign has the most events of each pixel in that window."""
    begin = START_US + 1e6 * EVENT_WINDOW_S * window
    own = events[(events["t"] >= begin) & (events["t"] < begin + 1e6 * EVENT_WINDOW_S)]
    found = np.zeros((48, 64), int)
    np.add.at(found, (own["y"], own["x"]), np.where(own["p"], 1, -1))
    return np.sign(found)


@pytest.fixture(scope="module")
def page(pictured, tmp_path_factory):
    """A page of a dataset whose first picture is taken when its variant's events begin."""
    dataset = shutil.copytree(pictured, tmp_path_factory.mktemp("events") / "dataset")
    events = make_events(40_000)
    put_events(dataset, events)
    for number, path in enumerate(sorted((dataset / "records" / "nominal").iterdir())):
        record = json.loads(path.read_text())
        path.unlink()  # which may be a link
        path.write_text(json.dumps({**record, "time_s": START_US / 1e6 - number}))
    out = dataset.parent / "page"
    spin_usd.show(dataset, out=out, workers=1)
    return out, events, dataset


def test_the_file_has_the_balance_of_each_window(tmp_path) -> None:
    events = make_events(40_000)
    stream = EventStream(FileIn(Folder(tmp_path), write_events(tmp_path / "a.h5", events).name))
    content = zlib.decompress(base64.b64decode(event_file(stream, START_US / 1e6).script("a").split(b'"')[3]))
    more = np.frombuffer(content[-EVENT_WINDOWS * 48 * 64 :], np.uint8).reshape(EVENT_WINDOWS, 48, 64)
    for window in range(EVENT_WINDOWS):
        assert (np.sign(more[window].astype(int) - 128) == balance(events, window)).all()


def test_events_are_painted_by_their_sign_in_the_window_that_is_chosen(page, opened) -> None:
    out, events, _ = page
    shown = opened(out, "#picture/nominal/img000001")
    shown.wait_for_selector("[data-shown='nominal/img000001']")
    shown.keyboard.press("v")
    for window in (0, 3):
        shown.get_by_label("Time of events").fill(str(window))
        found = np.array(shown.locator("canvas[data-kind=events]").evaluate(PAINTED)).reshape(48, 64)
        assert (found == balance(events, window)).all()


def test_only_pictures_that_events_follow_have_them_and_nothing_is_made_twice(page) -> None:
    out, _, dataset = page
    again = spin_usd.show(dataset, out=out, workers=1)
    assert (again.made, again.damaged) == (0, {})
    first = spin_usd.show(dataset, out=out.parent / "other", workers=1, labels="none", images="small")
    assert first.damaged == {}
    (dataset / "events" / "nominal.json").unlink()
    without = spin_usd.show(dataset, out=out.parent / "other", workers=1, labels="none", images="small")
    assert (without.made, without.damaged) == (0, {})
    assert without.bytes < first.bytes
