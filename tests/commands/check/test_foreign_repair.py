"""check --repair-to: a copy of a set of others with its lists mended, equal to the right set, all else unchanged."""

import csv
import json

import numpy as np
import pytest

from spin_usd import check
from spin_usd.exchange.sets.table import read_set
from tests.cases.foreign_sets import MATRICES, POSED, QUATERNIONS
from tests.commands.check.planted import PlantedSet, inverse, matrix

EXACT = 1e-12
LISTED = tuple(name for name in QUATERNIONS if name != "coco" and "yolo" not in name)
REPAIRED = (*LISTED, *MATRICES)
"""Layouts whose poses are the layout's own, which copies mend; COCO and YOLO have none."""
FAULTS = {
    "order": lambda q, t: (q, t),
    "inverse": lambda q, t: (inverse(q), t),
    "position of the camera": lambda q, t: (q, -matrix(q).T @ t),
    "inverse pose": lambda q, t: (inverse(q), -matrix(q).T @ t),
    "a thousandth": lambda q, t: (q, t / 1000),
    "a thousand": lambda q, t: (q, t * 1000),
}


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def numbers(folder):
    """All poses of the set by image, as its reader has them."""
    found, _, _ = read_set(folder, None)
    return {
        picture.name: np.concatenate([target.rotation.ravel(), target.t_cam_body])
        for picture in found.pictures
        for target in picture.targets
    }


def is_mended(foreign_sets, folder, name, fault) -> None:
    """Plant the fault, repair into a copy, and compare this with the right set."""
    wrong, out = foreign_sets.copy(name, folder / "wrong"), folder / "right"
    PlantedSet(wrong).poses(FAULTS[fault], scalar_last=fault == "order")
    before = contents(wrong)
    report = check(wrong, repair_to=out, **foreign_sets.options(name))
    assert report.errors, "the fault was not found"
    assert report.repaired
    assert contents(wrong) == before, "the set itself was changed"
    again = check(out, **foreign_sets.options(name))
    assert not again.errors, again.findings
    right, mended = numbers(foreign_sets.export(name)), numbers(out)
    assert mended.keys() == right.keys()
    for image, values in right.items():
        np.testing.assert_allclose(mended[image], values, rtol=EXACT, atol=EXACT)
    all_but_lists = {file for file, data in contents(out).items() if before.get(file) == data}
    assert before.keys() - all_but_lists == {row["list"] for row in changes(out)}


def changes(out):
    with (out / "repaired.csv").open() as file:
        return list(csv.DictReader(file))


def can_have(name, fault) -> bool:
    """Return whether the layout can have the fault: matrices have no order, and URSO's positions have axes of their
    own, in which those of the camera have no usual form."""
    return not (fault == "order" and name in MATRICES) and not (
        fault in ("position of the camera", "inverse pose") and name == "urso"
    )


@pytest.mark.parametrize(("name", "fault"), [("speedplus", "inverse pose"), ("urso", "order")])
def test_mended_lists_are_those_of_the_right_set(foreign_sets, tmp_path, name, fault) -> None:
    is_mended(foreign_sets, tmp_path, name, fault)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "fault"),
    [(name, fault) for name in REPAIRED for fault in FAULTS if can_have(name, fault)],
)
def test_each_fault_is_mended_in_each_layout(foreign_sets, tmp_path, name, fault) -> None:
    is_mended(foreign_sets, tmp_path, name, fault)


@pytest.mark.parametrize("name", ["speedplus", "spark stream 2"])
def test_names_of_images_in_another_case_are_mended(foreign_sets, tmp_path, name) -> None:
    wrong, out = foreign_sets.copy(name, tmp_path / "wrong"), tmp_path / "right"
    for path in PlantedSet(wrong).image_files()[::4]:
        path.rename(path.with_name(path.name.upper()))
    options = foreign_sets.options(name) | {"without_pixels": True}
    report = check(wrong, repair_to=out, **options)
    assert {finding.code for finding in report.findings} == {"image-name"}
    assert not check(out, **options).findings
    assert len(changes(out)) == 6
    for image, values in numbers(wrong).items():
        np.testing.assert_array_equal(numbers(out)[image], values)


def test_every_changed_value_is_listed_before_and_after(foreign_sets, tmp_path) -> None:
    wrong, out = foreign_sets.copy("speedplus", tmp_path / "wrong"), tmp_path / "right"
    PlantedSet(wrong).poses(FAULTS["inverse"])
    check(wrong, repair_to=out)
    rows = changes(out)
    assert len(rows) == 24
    for row in rows:
        before, after = (json.loads(row[key]) for key in ("before", "after"))
        entry = json.loads((out / row["list"]).read_text())[int(row["entry"].removeprefix("entry "))]
        assert entry[row["key"]] == after == (np.array(before) * [1, -1, -1, -1]).tolist()


@pytest.mark.parametrize("what", ["folder", "file", "inside"])
def test_an_existing_copy_or_one_in_the_set_is_refused(foreign_sets, tmp_path, spin_usd, what) -> None:
    wrong = foreign_sets.copy("speedplus", tmp_path / "wrong")
    PlantedSet(wrong).poses(FAULTS["inverse"])
    out = wrong / "right" if what == "inside" else tmp_path / "right"
    if what == "folder":
        out.mkdir()
    elif what == "file":
        out.write_text("mine")
    before = contents(tmp_path)
    said = "lies inside the set" if what == "inside" else "exists already"
    assert said in spin_usd("check", wrong, "--repair-to", out, code=2).stderr
    assert contents(tmp_path) == before
    assert out.is_dir() == (what == "folder")


@pytest.mark.parametrize("name", ["spark 2022", "coco"])
def test_a_set_without_such_faults_is_not_copied(foreign_sets, tmp_path, name) -> None:
    notes: list[str] = []
    report = check(foreign_sets.export(name), repair_to=tmp_path / "out", without_pixels=True, on_note=notes.append)
    assert report.repaired == []
    assert any(note.startswith("no copy was made") for note in notes)
    assert not (tmp_path / "out").exists()


def test_all_posed_layouts_but_coco_and_yolo_are_repaired() -> None:
    assert {*POSED} - {*REPAIRED} == {"coco", "yolo detect", "yolo pose", "yolo segment"}
