"""The order in which pictures are handed to workers."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from spin_usd.commands.render.task_queue import RenderTask, TaskQueue
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.processes.task import Worker


def task(index, geometry="g", radiance="r", kinds=("image", "depth")):
    picture = PlannedPicture(
        variant="v", index=index, frame=f"f{index}", time_code=0.0, geometry=geometry, radiance=radiance,
        exposure=f"e{index}", targets="t", region=(0, 0, 1, 1),
        target_pixels=1,
        light_groups=1, features=(),
    )  # fmt: skip
    return RenderTask(picture=picture, kinds=kinds)


WORKER = Worker[RenderTask](number=0, opened=True)


def queue_of(tasks):
    return TaskQueue(tasks, lambda task: 60.0)


def test_the_second_of_two_that_need_one_pass_waits_and_others_go_first() -> None:
    first, second, third = task(0), task(1), task(2, "h", "s")
    queue = queue_of([first, second, third])
    assert queue.take(WORKER) is first
    assert queue.take(WORKER) is third
    assert queue.take(WORKER) is None
    queue.finish(first)
    assert queue.take(WORKER) is second


def test_once_a_pass_was_made_all_that_need_it_go_at_once() -> None:
    tasks = [task(i) for i in range(4)]
    queue = queue_of(tasks)
    queue.finish(queue.take(WORKER))
    assert [queue.take(WORKER) for _ in range(3)] == tasks[1:]


def test_a_pass_that_failed_is_made_by_the_next_alone() -> None:
    tasks = [task(i) for i in range(3)]
    queue = queue_of(tasks)
    queue.give_up(queue.take(WORKER))
    assert queue.take(WORKER) is tasks[1]
    assert queue.take(WORKER) is None


def test_labels_alone_do_not_wait_for_a_render() -> None:
    queue = queue_of([task(0, kinds=("image",)), task(1, kinds=("depth",))])
    assert queue.take(WORKER) is not None
    assert queue.take(WORKER) is not None


TASKS = st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), max_size=12)


@given(needs=TASKS, steps=st.lists(st.tuples(st.integers(0, 4), st.integers(0, 9))), workers=st.integers(1, 4))
def test_no_pass_is_made_by_two_and_no_task_is_lost(needs, steps, workers) -> None:
    queue = queue_of([task(i, f"g{g}", f"r{g}{r}") for i, (g, r) in enumerate(needs)])
    out: list[RenderTask] = []
    ended: list[int] = []
    made: set[Any] = set()
    for what, which in [*steps, *[(0, 0), (4, 0)] * len(needs) * 2]:
        if what < 3 and len(out) < workers and (taken := queue.take(WORKER)):
            assert not (taken.needs - made) & {key for other in out for key in other.needs}
            out.append(taken)
        elif what == 3 and out:
            queue.put_back(out.pop(which % len(out)))
        elif what == 4 and out:
            done = out.pop(which % len(out))
            queue.finish(done)
            made |= done.needs
            ended.append(done.picture.index)
    assert sorted(ended) == list(range(len(needs)))
