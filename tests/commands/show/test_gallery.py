"""Tests of the folder that `show` writes."""

import json
import shutil
import signal

import pytest

import spin_usd
from spin_usd.basics.stop_signals import Stopped
from spin_usd.commands.show.gallery_folder import page_files
from spin_usd.commands.show.in_child import region_of_targets
from spin_usd.errors import InputError

SVG = b"http://www.w3.org/2000/svg"  # the name of a vocabulary, which nothing loads


def contents(folder):
    """The bytes of all files in the folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture
def copied(pictured, tmp_path):
    """A copy of the dataset to change."""
    return shutil.copytree(pictured, tmp_path / "dataset", copy_function=shutil.copy)


def test_run_again_it_makes_nothing_and_the_same(pictured, shown) -> None:
    before = contents(shown)
    report = spin_usd.show(pictured, out=shown, beside=pictured)
    assert (report.pictures, report.made, report.kept, report.damaged) == (6, 0, 6, {})
    assert contents(shown) == before
    assert report.bytes == sum(map(len, before.values()))


@pytest.mark.slow
def test_the_number_of_workers_changes_no_byte(pictured, shown, tmp_path) -> None:
    report = spin_usd.show(pictured, out=tmp_path / "page", beside=pictured, workers=2)
    assert report.made == 3  # variants share what is the same
    assert contents(tmp_path / "page") == contents(shown)


def test_it_makes_what_changed_and_removes_what_nothing_uses(copied, tmp_path) -> None:
    out = tmp_path / "page"
    spin_usd.show(copied, out=out, workers=1)
    before = contents(out)
    (out / "notes.txt").write_text("mine")
    for path in (copied / "records").glob("*/img000002.json"):
        path.unlink()
    report = spin_usd.show(copied, out=out, workers=1)
    assert (report.pictures, report.made) == (4, 0)
    after = contents(out)
    assert {name for name in before if name.startswith("images/")} - set(after)
    assert after["notes.txt"] == b"mine"


def test_stopped_half_way_it_goes_on_from_there(pictured, shown, tmp_path) -> None:
    out = tmp_path / "page"

    def stop(what, done, total) -> None:
        if (what, done) == ("showing: picture", 2):
            raise Stopped(signal.SIGINT)

    with pytest.raises(Stopped):
        spin_usd.show(pictured, out=out, beside=pictured, workers=1, on_progress=stop)
    assert not (out / "index.html").exists()
    assert spin_usd.show(pictured, out=out, beside=pictured, workers=1).made < 3
    assert contents(out) == contents(shown)


def test_images_are_as_asked_for(pictured, tmp_path) -> None:
    out = tmp_path / "page"
    spin_usd.show(pictured, out=out, images="original", labels="none", workers=1)
    made = [path.read_bytes() for path in (out / "images").rglob("*.png")]
    assert sorted(made) == sorted(path.read_bytes() for path in (pictured / "image" / "nominal").iterdir())


@pytest.mark.parametrize(
    ("boxes", "expected"),
    [
        ([], (0, 0, 240, 150)),
        ([(100, 50, 140, 75)], (95, 47, 145, 78)),
        ([(0, 0, 40, 25)], (0, 0, 50, 31)),
        ([(200, 120, 240, 150), (0, 0, 1, 1)], (0, 0, 240, 150)),
        ([(100, 50, 101, 51)], (92, 42, 108, 58)),
    ],
)
def test_the_part_around_the_targets_lies_in_the_frame(boxes, expected) -> None:
    found = region_of_targets(boxes, 150, 240)
    assert (found.x0, found.y0, found.x1, found.y1) == expected


def test_a_folder_that_holds_something_else_is_refused(pictured, tmp_path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds mine.txt but no gallery.json"):
        spin_usd.show(pictured, out=tmp_path)
    with pytest.raises(InputError, match="lies in the dataset"):
        spin_usd.show(pictured, out=pictured / "page")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_link_in_the_folder_is_not_followed(pictured, shown, tmp_path) -> None:
    out = shutil.copytree(shown, tmp_path / "page")
    shutil.rmtree(out / "images")
    (tmp_path / "elsewhere").mkdir()
    (out / "images").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="is a link"):
        spin_usd.show(pictured, out=out)
    assert not any((tmp_path / "elsewhere").iterdir())


def test_what_is_no_dataset_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="is not a dataset"):
        spin_usd.show(tmp_path, out=tmp_path / "page")


def test_the_page_loads_all_of_its_files_and_nothing_else() -> None:
    files = page_files()
    html = files["index.html"].decode()
    assert all(f'"page/{name}"' in html for name in files if name != "index.html")
    assert html.count('="page/') == len(files) - 1
    assert not [name for name, data in files.items() if b"://" in data.replace(SVG, b"")]


def test_the_marker_says_whose_folder_it_is(shown) -> None:
    found = json.loads((shown / "gallery.json").read_text())
    assert found == {"schema": "gallery-1", "dataset": "my dataset", "spin_usd": spin_usd.__version__}
