"""Poses through USD: as exact 1.5e11 m from the stage's origin as at it."""

import numpy as np
import pytest

from spin_usd.errors import StageError
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader
from tests.extremes.stages import STAGES, StageCase, angle, angle_bound, place_bound, rounding_of_the_text


def written(case, folder):
    path = folder / "stage.usda"
    path.write_text(case.text())
    return path


def pose(case, folder):
    reader = StageReader(written(case, folder))
    return reader.scene(reader.frames[0]).bodies[0].T_cam_body


@pytest.mark.parametrize("case", STAGES, ids=str)
def test_the_pose_is_that_of_the_numbers_in_the_text(case, tmp_path) -> None:
    R, t = case.true_pose()
    found = pose(case, tmp_path)
    assert angle(found.rotation, R) <= angle_bound(case)
    assert np.linalg.norm((found.translation - t).astype(float)) <= place_bound(case)


@pytest.mark.parametrize("case", STAGES, ids=str)
def test_what_was_meant_is_lost_only_where_the_text_itself_cannot_hold_it(case, tmp_path) -> None:
    """A far origin costs nothing where it is that of a prim that holds both; else a double's step there."""
    off = np.linalg.norm(pose(case, tmp_path).translation - case.meant_place())
    assert off <= place_bound(case) + rounding_of_the_text(case)
    if case.world:
        assert off < 1e-13


@pytest.mark.parametrize(("off", "codes"), [(0, []), (1e-12, []), (1e-7, ["pose-norm"]), (0.999e-6, ["pose-norm"])])
def test_a_quaternion_that_usd_misreads_is_told(off, codes, tmp_path) -> None:
    path = written(StageCase(name="off", norm=1 + off), tmp_path)
    found = [finding for finding in check_stage(path) if finding.code in ("pose-norm", "scene")]
    assert [finding.code for finding in found] == codes
    assert all(f"up to {2 * off:.2g} rad off" in finding.message for finding in found)


def test_a_quaternion_further_off_is_refused(tmp_path) -> None:
    with pytest.raises(StageError, match=r"norm is off 1 by 1.01e-06, which USD reads as another rotation"):
        pose(StageCase(name="off", norm=1 + 1.01e-6), tmp_path)
