"""The work of a picture and how long a run takes: laws of cost and of scheduling."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.commands.plan.report import measured_renders
from spin_usd.picture.kinds import BEAUTY_PASS, DEVICE_PASS, LABEL_PASS
from spin_usd.planning.cost import expected_work
from spin_usd.planning.make_plan import SHARED_FROM, make_plan
from spin_usd.planning.picture_columns import Extents
from spin_usd.planning.request import PlanRequest
from spin_usd.planning.wall_time import DEVICE_ALONE, PLANNED_S, one_core, wall_seconds
from spin_usd.planning.work import CommonWork, PictureWork, Work
from spin_usd.scene.effort import Effort
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases import measurements
from tests.cases.requests import request_for

OPTIONS = CommonWork(renderer="blender", effort=Effort(), kinds=("image", "depth"), frame_pixels=240 * 150)


@pytest.fixture(scope="module")
def pictures(small_stage):
    return planned(small_stage).pictures


def planned(stage, frames=None):
    question = PlanRequest(request=request_for(stage, frames=frames, effort=Effort(), seed=0))
    return make_plan(question, processes=1, progress=lambda *_: None)


def test_more_of_anything_costs_more(pictures) -> None:
    def seconds(effort):
        task = PictureWork(picture=pictures[0], label_pass=True, render=True)
        return expected_work(task, replace(OPTIONS, effort=effort))[BEAUTY_PASS]

    usual = seconds(Effort())
    for more in (Effort(samples=32), Effort(denoiser="fast")):
        assert seconds(more) > usual
    for less in (Effort(samples=8), Effort(samples=16, reduction=2)):
        assert seconds(less) < usual
    assert seconds(Effort(samples=1024, adaptive=0.1)) < seconds(Effort(samples=1024))


def test_labels_that_cast_rays_cost_more(pictures) -> None:
    def seconds(*labels):
        task = PictureWork(picture=pictures[0], label_pass=True, render=False)
        return expected_work(task, replace(OPTIONS, kinds=labels))["labels"]

    assert seconds("depth", "flow") > seconds("depth", "lit") > seconds("depth") == seconds("depth", "range")


def test_an_extent_holds_the_target(small_stage) -> None:
    reader = StageReader(small_stage)
    for frame in reader.frames:
        x0, y0, x1, y1, target = Extents().of(reader.scene(frame), "")
        assert 0 < target <= (x1 - x0) * (y1 - y0)


SECONDS = st.lists(st.floats(0, 100), min_size=1, max_size=20)


def wall(works, workers, cores=1):
    return wall_seconds(works, planned=0, variants=0, workers=workers, cores=cores)


def spent(works, workers, cores=1):
    """Without the start."""
    return wall(works, workers, cores) - wall([Work(render=0, rest=0)], 1)


@given(seconds=SECONDS, workers=st.integers(1, 8), cores=st.integers(1, 8))
def test_a_run_takes_at_least_its_longest_picture_and_its_share_and_no_more_than_both(seconds, workers, cores) -> None:
    took = spent([Work(render=0, rest=s) for s in seconds], workers, cores)
    count = min(workers, len(seconds))
    slowest = max(count / cores, 1) * (max(seconds) + sum(seconds) / count)
    assert max(max(seconds), sum(seconds) / min(count, cores)) - 1e-6 <= took <= slowest + 1e-6


@given(seconds=SECONDS, workers=st.integers(1, 8), cores=st.integers(1, 8), share=st.floats(0, 1))
def test_what_a_run_took_is_what_another_like_it_is_planned_to_take(seconds, workers, cores, share) -> None:
    taken = [{BEAUTY_PASS: share * s, "files": (1 - share) * s} for s in seconds]
    count = min(workers, len(taken))
    ends = [0.0] * count
    for s in seconds:  # each worker takes the next picture when it has made one
        ends[ends.index(min(ends))] += s
    alone = [Work.of(one_core(each, workers=count, cores=cores)) for each in taken]
    assert spent(alone, workers, cores) == pytest.approx(max(ends), abs=1e-6)


def test_no_pictures_take_no_time_and_cores_speed_up_renders_alone() -> None:
    assert wall([], 2) == 0
    works = (Work.of({kind: 9.0}) for kind in (BEAUTY_PASS, LABEL_PASS, "files"))
    render, label_pass, files = (wall([work], 1, cores=2) - wall([work], 1) for work in works)
    assert render < 0 == label_pass == files


@given(seconds=SECONDS, workers=st.integers(1, 8))
def test_a_device_is_shared_and_cores_do_not_speed_it_up(seconds, workers) -> None:
    works = [Work.of({DEVICE_PASS: s, "files": 1.0}) for s in seconds]
    took = spent(works, workers, cores=8)
    assert took == spent(works, workers, cores=16)
    assert DEVICE_ALONE * sum(seconds) - 1e-6 <= took <= sum(s + 1 for s in seconds) + 1e-6


def test_light_on_a_device_is_work_of_its_own(pictures) -> None:
    task = PictureWork(picture=pictures[0], label_pass=True, render=True)
    here, there = expected_work(task, OPTIONS), expected_work(task, replace(OPTIONS, device="optix"))
    assert {*here} - {*there} == {BEAUTY_PASS}
    assert {*there} - {*here} == {DEVICE_PASS}
    many = replace(OPTIONS, effort=Effort(samples=4096))
    assert expected_work(task, replace(many, device="optix"))[DEVICE_PASS] < expected_work(task, many)[BEAUTY_PASS] / 10


@pytest.mark.parametrize(("cores", "shares"), [(1, 1), (2, 2), (8, 2)])
def test_only_many_pictures_are_planned_by_as_many_processes_as_planning_takes(cores, shares) -> None:
    def planning(pictures):
        none = [Work(render=0, rest=0)]
        return wall_seconds(none, planned=pictures, variants=0, workers=1, cores=cores) - wall(none, 1)

    few, many = SHARED_FROM - 1, 10 * SHARED_FROM
    assert planning(few) == pytest.approx(PLANNED_S * few)
    assert planning(many) == pytest.approx(PLANNED_S * many / shares)


def test_measured_pictures_are_expected_to_take_what_they_took_and_the_rest_as_ever(small_stage) -> None:
    plan = planned(small_stage, frames="0:3")
    options = replace(OPTIONS, effort=Effort(samples=64))
    made = [
        measurements.figures(measurements.setting("samples=64"), cpu_s=3, frame=picture.frame)
        for picture in plan.pictures
    ]
    other = measurements.figures(measurements.setting("samples=1"), cpu_s=100, frame=plan.pictures[0].frame)
    found = measured_renders(measurements.measurement([*made, other]), plan, options)
    expected = [
        expected_work(PictureWork(picture=each, label_pass=True, render=True), options) for each in plan.pictures
    ]
    scaled = [found.scaled(each) for each in expected]
    assert sum(each[BEAUTY_PASS] for each in expected) != pytest.approx(9, rel=0.1)
    assert sum(each[BEAUTY_PASS] for each in scaled) == pytest.approx(9)
    for before, after in zip(expected, scaled, strict=True):
        assert {work for work in before if after[work] != before[work]} == {BEAUTY_PASS}
