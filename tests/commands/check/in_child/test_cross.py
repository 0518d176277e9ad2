"""By what two exact passes may differ, and what is a fault: labels of a box changed in known ways."""

import json
from collections import Counter

import numpy as np
import pytest

import spin_usd as package
from spin_usd.commands.check.in_child.cross import EDGE_SHARE, FEW, _coincident, disagreements
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.formats.array_file import encoded_array
from spin_usd.labels.table import LABELS
from tests.cases.labelled import labels_of
from tests.cases.scenes import BARREL, box, pose, scene, target

POINTS, FACES = box()
HALVES = np.arange(len(FACES)) % 2 + 1
SCENE = scene(target(POINTS, FACES, parts=HALVES), camera=BARREL, T_cam_body=pose((0.9, 0.3, 0.2, 0.1), (0.2, -0.1, 5)))
COMPARED = ("segmentation", "depth", "dense_pose")
TRUE = {kind: array for kind, array in labels_of(SCENE).items() if kind in COMPARED}
SEEN = TRUE["depth"] > 0


def as_around(plane):
    """Where a pixel is as its four neighbours are."""
    return np.logical_and.reduce([plane == np.roll(plane, step, axis) for axis in (0, 1) for step in (1, -1)])


RIM = SEEN & ~as_around(SEEN)
INNER = SEEN & as_around(TRUE["segmentation"])
NOWHERE = np.zeros(SEEN.shape, bool)
PIXEL_M = 5 / BARREL.fx  # metres that a pixel is wide on the target


def found(coincident=NOWHERE, **changed):
    """How many pixels differ by quantity, where some of the labels are `changed`."""
    pixels: Counter[str] = Counter()
    for each in disagreements({**TRUE, **changed}, TRUE, BARREL, coincident=coincident):
        pixels[each.quantity] += each.pixels
    return pixels


def test_equal_labels_agree() -> None:
    assert SEEN.sum() > 2000
    assert found() == {}


@pytest.mark.parametrize("missing", COMPARED)
def test_labels_that_a_dataset_lacks_are_not_compared(missing) -> None:
    some = {kind: array for kind, array in TRUE.items() if kind != missing}
    assert list(disagreements(some, TRUE, BARREL, coincident=NOWHERE)) == []


def test_a_picture_moved_by_a_pixel_differs_in_its_silhouette() -> None:
    moved = {kind: np.roll(array, 1, axis=1) for kind, array in TRUE.items()}
    assert found(**moved)["silhouette"] >= 2 * SEEN.any(1).sum()


def test_another_part_is_found_unless_it_lies_there_too() -> None:
    swapped = np.where(SEEN, 3 - TRUE["segmentation"], 0).astype(np.uint16)
    assert found(segmentation=swapped) == {"part": SEEN.sum()}
    assert found(segmentation=swapped, coincident=SEEN) == {}


@pytest.mark.parametrize(("pixels", "there"), [(0.005, False), (0.05, True)])
def test_depth_and_body_points_are_held_to_a_hundredth_of_a_pixel(pixels, there) -> None:
    off = (pixels * PIXEL_M * SEEN).astype(np.float32)
    assert ("depth" in found(depth=TRUE["depth"] + off)) == there
    assert ("body point" in found(dense_pose=TRUE["dense_pose"] + off[..., None] * np.float32([1, 0, 0]))) == there


def at(place, count):
    """Depth doubled in so many pixels of a place, evenly spread."""
    depth = TRUE["depth"].copy()
    rows, columns = np.nonzero(place)
    chosen = np.linspace(0, len(rows) - 1, count).astype(int)
    depth[rows[chosen], columns[chosen]] *= 2
    return found(depth=depth)["depth"]


def test_a_hundredth_of_the_pixels_at_edges_may_differ_and_a_few_elsewhere() -> None:
    allowed = FEW + int(EDGE_SHARE * RIM.sum())
    assert allowed > FEW
    assert at(RIM, allowed) == 0
    assert at(RIM, RIM.sum()) == RIM.sum()
    assert at(INNER, FEW) == 0
    assert at(INNER, FEW + 1) == FEW + 1


@pytest.mark.parametrize("wrong", [0.5, np.nan])
def test_what_is_wrong_within_a_surface_is_not_excused_by_long_edges(wrong) -> None:
    """However far off: an altered pixel must not pass for an edge of its own."""
    rows, columns = (index[:: len(index) // 5] for index in np.nonzero(INNER))
    depth = TRUE["depth"].copy()
    depth[rows, columns] *= wrong
    assert found(depth=depth)["depth"] > FEW


@pytest.mark.parametrize(("offset", "there"), [((0, 0, 0), True), ((0.1, 0.07, 0.05), False)])
def test_parts_that_lie_in_one_another_are_each_others(offset, there) -> None:
    """Two boxes of two parts in the same place, and the second moved aside."""
    points, faces = np.concatenate([POINTS, np.add(POINTS, offset)]), np.concatenate([FACES, FACES + len(POINTS)])
    boxes = target(points, faces, parts=np.repeat([1, 2], len(FACES)))
    double = scene(boxes, camera=BARREL, T_cam_body=SCENE.T_cam_body)
    theirs = {kind: array for kind, array in labels_of(double).items() if kind in COMPARED}
    seen = theirs["segmentation"] > 0
    swapped = np.where(seen, 3 - theirs["segmentation"], 0).astype(np.uint16)
    excused = _coincident(double, {**theirs, "segmentation": swapped}, theirs)
    np.testing.assert_array_equal(excused, seen & there)


@pytest.fixture
def described(tmp_path):
    """A folder that is a dataset by its description alone."""
    (tmp_path / "dataset.json").write_text("{}")
    return tmp_path


@pytest.mark.slow
def test_cycles_agrees_and_finds_what_was_changed(small_stage, tmp_path, spin_usd) -> None:
    """The second picture's depth is moved by a pixel; its digest, which `check` holds too, is another finding."""
    made = tmp_path / "dataset"
    package.render(small_stage, out=made, frames="0:3", labels_only=True, workers=1)
    picture = package.Dataset(made)[1]
    moved = np.roll(picture.label("depth"), 1, axis=1)
    (made / picture.files["depth"].path).write_bytes(
        encoded_array(moved, ".exr", kind="depth", channels=LABELS["depth"].channels)
    )
    said = json.loads(spin_usd("check", made, "--cross", "--json", code=1).stdout)
    crossed = [finding for finding in said["findings"] if finding["code"] == "cross"]
    assert said["compared"] == 3
    assert {finding["where"] for finding in crossed} == {"records/nominal/img000002.json"}
    assert any("the depth differs" in finding["message"] for finding in crossed)


def test_pictures_are_counted_for_a_comparison_alone(described) -> None:
    with pytest.raises(InputError, match="cross_pictures is given without cross"):
        package.check(described, cross_pictures=1)


def test_without_blender_nothing_is_advised_that_check_does_not_have(described, monkeypatch) -> None:
    monkeypatch.setattr("spin_usd.processes.open_renderer.find_spec", lambda _: None)
    with pytest.raises(UnsupportedError, match=r"needs bpy, .* (pip install|Python 3\.13).*, or leave --cross out$"):
        package.check(described, cross=True)


def test_a_stage_is_not_crossed(small_stage) -> None:
    with pytest.raises(InputError, match="which --cross needs"):
        package.check(small_stage, cross=True)
