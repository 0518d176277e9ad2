"""An export is of one dataset in one way, resumes to the same bytes, and refuses before it writes."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter

import pytest

import spin_usd
from spin_usd.commands.export.writer import RowText, Writer
from spin_usd.errors import InputError, OutputError, UnsupportedError
from spin_usd.exchange.layout.index_file import text_lines
from tests.exchange.conftest import PLAIN, blank, clone, contents, write_export

MANY = 60


@pytest.fixture(scope="module")
def many(rendered, tmp_path_factory):
    """Many frames; the poses of two are the same."""
    turned = [1.0, 0.0, 0.0, 0.0]
    pictures = [{"frame": f"img{number:03}", "q": turned, "t": [0.0, 0.0, 5.0 + number // 2]} for number in range(MANY)]
    return clone(rendered, tmp_path_factory.mktemp("many") / "dataset", pictures)


def test_variants_of_a_pose_share_a_split_and_get_names_of_their_own(two_variants, tmp_path) -> None:
    report = write_export(two_variants, "speedplus", tmp_path / "out", split="train=0.5,validation=0.5")
    assert dict(report.splits) == {"train": 6, "validation": 6}
    with (tmp_path / "out" / "pictures.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows[:2]] == ["img000001-nominal", "img000002-nominal"]
    assert len({row["name"] for row in rows}) == len(rows) == 12
    split = {(row["frame"], row["variant"]): row["split"] for row in rows}
    assert all(split[frame, "nominal"] == split[frame, "noisy_1"] for frame, _ in split)


def test_equal_poses_share_a_split(many, tmp_path) -> None:
    write_export(many, "speedplus", tmp_path / "out", split="train=0.5,test=0.5", options={"masks": "none"})
    with (tmp_path / "out" / "pictures.csv").open() as file:
        splits = [row["split"] for row in csv.DictReader(file)]
    assert splits[::2] == splits[1::2]
    assert {"train", "test"} == set(splits)


def test_frames_and_variants_are_chosen(two_variants, tmp_path) -> None:
    report = write_export(two_variants, "speedplus", tmp_path / "out", frames="1:3", variants=("noisy_*",))
    assert report.pictures == 2
    rows = json.loads((tmp_path / "out" / "synthetic" / "train.json").read_text())
    assert [row["filename"] for row in rows] == ["img000002.jpg", "img000003.jpg"]


def test_files_are_linked_or_copied(two_variants, tmp_path) -> None:
    image = two_variants / "image" / "nominal" / "img000001.png"
    for name, copy in (("linked", False), ("copied", True)):
        write_export(two_variants, "croissant", tmp_path / name, variants=("nominal",), copy=copy)
        exported = tmp_path / name / "image" / "img000001.png"
        assert exported.read_bytes() == image.read_bytes()
        assert exported.samefile(image) is not copy


def test_a_second_run_makes_what_is_missing_alone(two_variants, tmp_path) -> None:
    first = write_export(two_variants, "speedplus", tmp_path / "out")
    before = contents(tmp_path / "out")
    (tmp_path / "out" / "synthetic" / "train.json").unlink()
    (tmp_path / "out" / "synthetic" / "images" / "img000001-nominal.jpg").unlink()
    again = write_export(two_variants, "speedplus", tmp_path / "out")
    assert contents(tmp_path / "out") == before
    assert (again.made, again.kept) == (2, first.made + first.linked - 2)


def test_what_was_made_is_said_by_its_ending(two_variants, tmp_path, spin_usd) -> None:
    done = spin_usd("export", two_variants, "--to", "croissant", "--out", tmp_path / "out")
    linked = sum(path.stat().st_nlink > 1 for path in (tmp_path / "out").rglob("*") if path.is_file())
    endings = Counter(path.suffix for path in (tmp_path / "out").rglob("*.*") if path.stat().st_nlink == 1)
    del endings[".json"]  # the manifest too, which is no picture's
    assert f"{linked} files linked to the dataset's, " in done.stdout
    copied = spin_usd("export", two_variants, "--to", "croissant", "--out", tmp_path / "copied", "--copy")
    assert f"{linked} files copied from the dataset, " in copied.stdout
    assert all(f"{number} {ending}" in done.stdout for ending, number in endings.items())


def test_a_full_disk_is_said_with_the_file_that_it_is_of(tmp_path) -> None:
    """What rows wait in has no more room than the file that they go to; it is let go of without another word."""
    (tmp_path / "0-0").symlink_to("/dev/full")
    writer = Writer(out=tmp_path / "out", work=tmp_path, copy=False, indexes={"train.txt": text_lines()})
    writer.add(RowText("train.txt", "", "img000001.png\n"))
    with pytest.raises(OutputError, match=r"out/train\.txt: cannot be written \(No space left"):
        writer.finish()
    writer.close()


def test_what_the_owner_wrote_into_the_card_stays(two_variants, tmp_path) -> None:
    write_export(two_variants, "speedplus", tmp_path / "out")
    card = tmp_path / "out" / "README.md"
    card.write_text(card.read_text() + "CC BY 4.0\n")
    write_export(two_variants, "speedplus", tmp_path / "out")
    assert card.read_text().endswith("CC BY 4.0\n")


@pytest.mark.parametrize("to", ["coco", "webdataset"])
def test_the_number_of_workers_changes_no_byte(many, tmp_path, to) -> None:
    """Rows in one index, in order; shards that are made of the pictures of several workers."""
    asked = {"options": {"pictures": "7"}} if to == "webdataset" else {}
    one, three = (write_export(many, to, tmp_path / str(count), workers=count, **asked) for count in (1, 3))
    assert contents(tmp_path / "1") == contents(tmp_path / "3")
    assert (one.linked, one.made, one.kept) == (three.linked, three.made, three.kept)


def test_a_killed_export_goes_on_to_the_same_bytes(many, tmp_path) -> None:
    """Killed by SIGKILL when some images are there."""
    write_export(many, "speedplus", tmp_path / "whole")
    out = tmp_path / "killed"
    code = (
        "import sys; from pathlib import Path; from tests.exchange.conftest import write_export; "
        "write_export(Path(sys.argv[1]), 'speedplus', Path(sys.argv[2]))"
    )
    with subprocess.Popen([sys.executable, "-c", code, many, out]) as process:
        while process.poll() is None and len(list(out.glob("synthetic/images/*"))) < 5:
            time.sleep(0.001)
        process.send_signal(signal.SIGKILL)
    made = len(list(out.glob("synthetic/images/*")))
    assert 5 <= made < MANY
    assert json.loads((out / "export.json").read_text())["complete"] is False
    report = write_export(many, "speedplus", out)
    assert report.kept >= made
    assert contents(out) == contents(tmp_path / "whole")


def test_two_exports_are_never_mixed(two_variants, many, tmp_path) -> None:
    out = tmp_path / "out"
    write_export(two_variants, "speedplus", out)
    before = contents(out)
    for asked, words in (
        ({"options": {"masks": "none"}}, "is an export with other options"),
        ({"split": "train=0.5,test=0.5"}, "is an export with other splits"),
        ({"seed": 1}, "is an export with another seed"),
        ({"frames": "0:1"}, "is an export of other pictures"),
    ):
        with pytest.raises(InputError, match=words):
            write_export(two_variants, "speedplus", out, **asked)
    with pytest.raises(InputError, match="is an export of another format"):
        write_export(two_variants, "croissant", out)
    with pytest.raises(InputError, match="is an export of other pictures"):
        write_export(many, "speedplus", out)
    assert contents(out) == before


def test_a_folder_of_something_else_is_left_alone(two_variants, tmp_path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds thesis.txt but no export.json; choose an empty folder"):
        write_export(two_variants, "speedplus", tmp_path)
    with pytest.raises(InputError, match="lies in the dataset; choose a folder beside it"):
        write_export(two_variants, "speedplus", two_variants / "image")
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize(
    ("to", "asked", "sentence"),
    [
        ("speedpus", {}, "there is no format 'speedpus'; did you mean speedplus"),
        ("speedplus", {"options": {"mask": "none"}}, "speedplus has no option 'mask'; choose among domain, image"),
        ("speedplus", {"options": {"masks": "all"}}, "option masks='all' is not possible; choose silhouette or parts"),
        ("speedplus", {"split": "dev=1"}, "speedplus has no split 'dev'; choose among train, validation, test"),
        ("speedplus", {"variants": ("dim",)}, "has no variant 'dim'; choose among noisy_1, nominal"),
        ("speedplus", {"frames": "9:"}, "has no picture to export"),
        ("speedplus", {"target": "moon"}, "has no target 'moon'; choose among tango"),
        ("shirt", {}, "the dataset has 2 variants, and shirt holds one trajectory; choose one of them"),
        ("speed", {}, "img000001-nominal: has lens distortion, for which speed has no field"),
        ("spark", {}, "has lens distortion, for which spark has no field"),
        ("urso", {}, "has lens distortion, for which urso has no field"),
        ("cubesat_cdt", {}, "has lens distortion, for which cubesat_cdt has no field"),
    ],
)
def test_what_cannot_be_exported_is_refused_in_a_sentence(two_variants, tmp_path, to, asked, sentence) -> None:
    with pytest.raises(spin_usd.SpinError) as caught:
        write_export(two_variants, to, tmp_path / "out", **asked)
    assert sentence in str(caught.value)
    assert not (tmp_path / "out").exists()


def refused(dataset, to, out, kind, words, **asked) -> None:
    with pytest.raises(kind, match=words):
        write_export(dataset, to, out, **asked)
    assert not out.exists()


def test_far_targets_are_refused_for_depth_in_millimetres(rendered, tmp_path) -> None:
    """The origin of its axes, at 65 m, is within the range, but not all of it."""
    dataset = clone(rendered, tmp_path / "far", [{"frame": "a"}, {"frame": "b", "t": [0.0, 0.0, 65.0]}])
    words = r"b: has its target up to 65.\d+ m away, and 16 bits of 1 mm end at 65.535 m; leave depth out"
    asked = {"options": {"layout": "2021"}}
    refused(dataset, "spark", tmp_path / "out", UnsupportedError, words, **asked)
    asked["options"] |= {"depth": "none"}
    write_export(dataset, "spark", tmp_path / "out", **asked)


def with_parts(dataset, count) -> None:
    described = json.loads((dataset / "dataset.json").read_text())
    part = next(iter(described["parts"].values()))
    described["parts"] = {str(number): part for number in range(1, count + 1)}
    (dataset / "dataset.json").write_text(json.dumps(described))


@pytest.mark.slow
def test_more_parts_than_the_numbers_hold_are_refused(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "parts", [{"frame": "a"}])
    with_parts(dataset, 300)
    words = "the target has 300 parts, and speedplus has 8 bits for them, 255 at most; merge parts"
    refused(dataset, "speedplus", tmp_path / "out", UnsupportedError, words, options={"masks": "parts"})
    with_parts(dataset, 70_000)
    words = "lists 70000 parts, and 16 bits of a segmentation hold 65535; merge parts"
    refused(dataset, "speedplus", tmp_path / "out", UnsupportedError, words)


@pytest.mark.parametrize(("name", "folder"), [("image", True), ("image/a.png", False), ("README.md", False)])
def test_links_in_an_export_are_not_followed(rendered, tmp_path, spin_usd, name, folder) -> None:
    """A folder and a file of the export are links to what lies outside it, which stays as it was."""
    dataset = clone(rendered, tmp_path / "linked", [{"frame": "a"}])
    out, outside = tmp_path / "out", tmp_path / "outside"
    write_export(dataset, "croissant", out)
    (out / name).rename(tmp_path / "moved")
    if folder:
        outside.mkdir()
    (out / name).symlink_to(outside)
    done = spin_usd("export", dataset, "--to", "croissant", "--out", out, code=2)
    assert f"{out / name}: is a link, which is not followed; replace it by its target" in done.stderr
    assert not (any(outside.iterdir()) if folder else outside.exists())


def test_a_name_with_a_path_in_it_is_refused(rendered, tmp_path) -> None:
    """A record calls its picture something else than its file's name says, or a file has a name like a path."""
    dataset = clone(rendered, tmp_path / "named", [{"frame": "a"}])
    path = dataset / "records" / "nominal" / "a.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"frame": "../../a"}))
    refused(dataset, "speedplus", tmp_path / "out", InputError, r"breaks schema record-1 at \$.frame: '../../a' does")
    path.write_text(json.dumps(record | {"frame": "b"}))
    refused(dataset, "speedplus", tmp_path / "out", InputError, r"a of nominal: calls itself 'b'")
    path.rename(path.with_name("..\\a.json"))
    refused(dataset, "speedplus", tmp_path / "out", InputError, "cannot name a picture; use up to 200 letters")


def test_a_file_outside_the_dataset_is_not_exported(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "outside", [{"frame": "a"}])
    path = dataset / "records" / "nominal" / "a.json"
    record = json.loads(path.read_text())
    (tmp_path / "secret.png").write_bytes((dataset / "image" / "nominal" / "a.png").read_bytes())
    record["files"]["image"]["path"] = "../secret.png"
    path.write_text(json.dumps(record))
    with pytest.raises(InputError, match=r"breaks schema record-1 at \$.files.image.path: '../secret.png'"):
        write_export(dataset, "croissant", tmp_path / "out")
    assert not list((tmp_path / "out").glob("image/*"))


def test_pictures_that_lack_a_file_are_refused(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "bare", [{"frame": "a"}, {"frame": "b", "kinds": ("depth",)}])
    words = "b: has no image, which speedplus needs; render it without --labels-only"
    refused(dataset, "speedplus", tmp_path / "out", InputError, words)
    words = "b: has other kinds of file than a, and croissant describes them once"
    record = dataset / "records" / "nominal" / "b.json"
    record.unlink()
    clone(rendered, dataset, [{"frame": "c", "kinds": ("image", "segmentation")}])
    refused(dataset, "croissant", tmp_path / "out", UnsupportedError, "c: has other kinds of file than a")


def test_a_dataset_that_shows_no_target_is_refused(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "dark", [{"frame": "a"}, {"frame": "b"}])
    blank(dataset, "a")
    blank(dataset, "b")
    words = "shows no pixel of its target in any picture; check the poses"
    refused(dataset, "speedplus", tmp_path / "out", InputError, words)
    refused(dataset, "spark", tmp_path / "out", InputError, words, options={"layout": "2021", "depth": "none"})


def test_a_target_larger_than_the_frame_fills_its_box(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "near", [{"frame": "a"}])
    path = dataset / "records" / "nominal" / "a.json"
    record = json.loads(path.read_text())
    record["targets"][0]["box"] = {"visible": [0, 0, 240, 150], "amodal": [-900, -700, 900, 700], "truncated": True}
    path.write_text(json.dumps(record))
    write_export(dataset, "spark", tmp_path / "out", options={"layout": "2021"})
    with (tmp_path / "out" / "train_labels.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert row["bbox"] == "[0, 0, 150, 240]"


def test_another_camera_is_refused_where_the_format_has_one(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "two", [{"frame": "a"}, {"frame": "b", "camera": PLAIN}])
    words = "b: has another camera than a, and speedplus has one for all pictures; choose variants of one camera"
    refused(dataset, "speedplus", tmp_path / "out", UnsupportedError, words)


def test_the_command_line_exports_and_lists(two_variants, tmp_path, spin_usd) -> None:
    options = ("--to", "speedplus", "--option", "masks=parts", "--option", "image=png", "--json", "--copy")
    done = spin_usd("export", two_variants, "--out", tmp_path / "out", *options)
    assert json.loads(done.stdout)["pictures"] == 12
    assert "exporting: picture 12 of 12" in done.stderr
    assert "speedplus: " in spin_usd("export", "--list").stdout
    assert "needs a dataset, --to and --out" in spin_usd("export", two_variants, code=2).stderr


def test_a_full_disk_leaves_no_half_file(two_variants, tmp_path, monkeypatch) -> None:
    """Linking and copying fail as on a full disk: what is there is whole, and a second run goes on."""
    out = tmp_path / "out"
    calls = []

    def fail(*args, **_):
        calls.append(args)
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "link", fail)
        patch.setattr("shutil.copyfileobj", fail)
        with pytest.raises(OutputError, match="No space left on device"):
            write_export(two_variants, "croissant", out)
    assert calls
    assert write_export(two_variants, "croissant", out).pictures == 12
