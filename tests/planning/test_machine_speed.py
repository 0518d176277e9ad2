"""How fast this machine is: tried by rays that cannot leave a body, kept for a kind of processor, never in the way."""

import json
from collections import Counter

import numpy as np
import pytest

from spin_usd.planning import in_child, machine_speed
from spin_usd.planning.machine_speed import TRIAL_S, keep_trial, kept_trial, slower_by


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """The folder of ours in a user's empty cache folder."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "spin_usd"


def test_what_is_kept_is_found_by_the_next_plan(folder) -> None:
    assert kept_trial() is None
    keep_trial(2 * TRIAL_S)
    assert kept_trial() == 2 * TRIAL_S
    assert len(list(folder.iterdir())) == 1
    assert slower_by(kept_trial()) == 2


def test_another_processor_in_the_same_home_is_tried_itself(monkeypatch) -> None:
    keep_trial(TRIAL_S)
    monkeypatch.setattr(machine_speed, "processor_model", lambda: "another")
    assert kept_trial() is None
    keep_trial(3 * TRIAL_S)
    assert kept_trial() == 3 * TRIAL_S


@pytest.mark.parametrize("text", ["", "{", "[]", '{"trial_s": "x"}', '{"trial_s": NaN}', '{"trial_s": 0}', "{}"])
def test_damage_is_nothing_and_is_written_over(folder, text) -> None:
    keep_trial(TRIAL_S)
    (file,) = folder.iterdir()
    file.write_text(text)
    assert kept_trial() is None
    keep_trial(TRIAL_S)
    assert kept_trial() == TRIAL_S


def test_a_folder_that_cannot_be_written_is_no_failure(folder) -> None:
    folder.parent.mkdir()
    folder.write_text("a file")
    keep_trial(TRIAL_S)
    assert kept_trial() is None


def test_without_a_folder_that_is_named_it_is_in_the_home(tmp_path, monkeypatch) -> None:
    """A relative one is ignored, as the XDG base directories have it."""
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    keep_trial(TRIAL_S)
    assert kept_trial() == TRIAL_S
    assert (tmp_path / "home" / ".cache" / "spin_usd").is_dir()


def test_no_ray_leaves_the_body_of_the_trial() -> None:
    """Every edge has a face on either side, and every face some extent."""
    points, faces = in_child._hollow_body()
    firsts = points[faces[:, 0]]
    areas = np.linalg.norm(np.cross(points[faces[:, 1]] - firsts, points[faces[:, 2]] - firsts), axis=1)
    assert areas.min() > 0
    welded = np.unique(points.round(9), axis=0, return_inverse=True)[1].reshape(-1)[faces]
    edges = Counter(
        tuple(sorted(edge)) for face in welded.tolist() for edge in zip(face, face[1:] + face[:1], strict=True)
    )
    assert set(edges.values()) == {2}
    assert in_child.trial_seconds() > 0


def test_the_command_tries_once_and_says_so(spin_usd, small_stage, monkeypatch) -> None:
    command = ("plan", small_stage, "--frames", "0:1")
    monkeypatch.setattr("spin_usd.planning.in_child.trial_seconds", lambda: TRIAL_S)
    once = json.loads(spin_usd(*command, "--json").stdout)
    assert once["speed"] == {"slower": 1, "measured": []}
    monkeypatch.setattr("spin_usd.planning.in_child.trial_seconds", lambda: pytest.fail("it was tried again"))
    assert "times are 1.00 times the published ones, by a trial of this machine" in spin_usd(*command).stdout
    keep_trial(2 * TRIAL_S)
    twice = json.loads(spin_usd(*command, "--json").stdout)
    assert twice["core_seconds"] == pytest.approx(2 * once["core_seconds"])
    assert twice["wall_seconds"] == pytest.approx(2 * once["wall_seconds"])
