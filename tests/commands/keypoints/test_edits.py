"""Edits of keypoints: each gives a new list, and refuses names that a dataset could not have."""

import numpy as np
import pytest

from spin_usd.commands.keypoints.edits import added, deleted, free_name, moved, renamed, table_lines
from spin_usd.commands.keypoints.session import History
from spin_usd.errors import InputError
from spin_usd.formats.table_file import read_keypoints_file
from spin_usd.scene.keypoints import Keypoints

THREE = Keypoints(names=("a", "b", "tip_3"), points=np.arange(9.0).reshape(3, 3))
PLACE = np.array([7.0, 8.0, 9.5])


def test_each_changes_what_it_names_and_nothing_before_it() -> None:
    more = added(THREE, "c", PLACE)
    assert more.names == ("a", "b", "tip_3", "c")
    assert (more.points[3] == PLACE).all()
    assert renamed(THREE, "b", "beta").names == ("a", "beta", "tip_3")
    assert (moved(THREE, "b", PLACE).points == [[0, 1, 2], PLACE, [6, 7, 8]]).all()
    fewer = deleted(THREE, "b")
    assert (fewer.names, fewer.points.tolist()) == (("a", "tip_3"), [[0, 1, 2], [6, 7, 8]])
    assert (THREE.names, THREE.points.tolist()) == (("a", "b", "tip_3"), np.arange(9.0).reshape(3, 3).tolist())


@pytest.mark.parametrize("name", ["", " a", "a ", "x\ny", "\x1b[31m", "n" * 65])
def test_names_that_cannot_be_are_refused(name) -> None:
    with pytest.raises(InputError, match="cannot name a keypoint"):
        added(THREE, name, PLACE)


def test_a_name_stands_for_one_point() -> None:
    with pytest.raises(InputError, match="'b' already"):
        added(THREE, "b", PLACE)
    with pytest.raises(InputError, match="'b' already"):
        renamed(THREE, "a", "b")
    assert renamed(THREE, "a", "a") == THREE


def test_free_names_count_on() -> None:
    assert free_name(THREE, "tip_3") == "tip_4"
    assert free_name(THREE, "a") == "a_1"
    assert free_name(THREE, "new") == "new"
    endless = "7" * 5000
    assert free_name(Keypoints(names=(endless,), points=np.zeros((1, 3))), endless) == f"{endless[:-1]}8"


def test_lines_of_a_table_are_read_as_the_same_keypoints(tmp_path) -> None:
    odd = Keypoints(names=("a, b", 'the "tip"', "c"), points=np.array([[1 / 3, -2e-9, 7], PLACE, [0, 0, 0.1]]))
    (tmp_path / "points.csv").write_text("\n".join(table_lines(odd)))
    read = read_keypoints_file(tmp_path / "points.csv")
    assert (read.names, read.points.tolist()) == (odd.names, odd.points.tolist())


def test_history_goes_back_and_on_and_forgets_what_was_undone_before_a_change() -> None:
    history = History("one")
    history.change("two")
    history.change("three")
    history.undo()
    history.undo()
    assert (history.now, history.can_undo, history.can_redo) == ("one", False, True)
    history.undo()
    history.redo()
    assert history.now == "two"
    history.change("other")
    assert (history.now, history.can_redo) == ("other", False)
    history.undo()
    assert history.now == "two"
