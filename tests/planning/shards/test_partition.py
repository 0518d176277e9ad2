"""A partition gives every picture to one shard, shares work out equally, and keeps together what shares passes."""

from collections import Counter, defaultdict
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.errors import InputError
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import expected_work
from spin_usd.planning.partition import partition
from spin_usd.planning.shard import Shard
from spin_usd.planning.work import CommonWork, Task
from spin_usd.scene.effort import Effort

OPTIONS = CommonWork(renderer="raycast", effort=Effort(samples=1), kinds=("image", "depth"), frame_pixels=320 * 200)
READING = 1.05  # to read a shared render takes little, and a partition leaves it out
EQUAL = 4 / 3  # Graham, 1969: the longest share of jobs that are dealt out from the longest, beside the best there is


def picture(variant, frame, geometry, radiance, pixels=5000):
    return PlannedPicture(
        variant=variant,
        index=frame,
        frame=f"img{frame:06d}",
        time_code=float(frame),
        geometry=geometry,
        radiance=radiance,
        exposure=f"{variant} {frame}",
        targets="",
        region=(0, 0, 200, 150),
        outline_pixels=pixels,
        target_pixels=pixels,
        light_groups=1,
        features=(),
    )


def cost(pictures):
    """Seconds to make the pictures on their own: each pass once."""
    labels, renders = {each.geometry: each for each in pictures}, {each.radiance: each for each in pictures}
    without = sum(total(Task(picture=each, label_pass=False, render=False)) for each in pictures)
    passes = sum(total(Task(picture=each, label_pass=True, render=False)) for each in labels.values())
    passes -= sum(total(Task(picture=each, label_pass=False, render=False)) for each in labels.values())
    passes += sum(total(Task(picture=each, label_pass=False, render=True)) for each in renders.values())
    passes -= sum(total(Task(picture=each, label_pass=False, render=False)) for each in renders.values())
    return without + passes


def total(task):
    return sum(expected_work(task, OPTIONS).values())


def by_shard(pictures, found):
    shards = defaultdict(list)
    for each, number in zip(pictures, found.shards, strict=True):
        shards[number].append(each)
    return shards


plans = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 3)), min_size=1, max_size=40).map(
    lambda rows: [picture("v", i, f"g{g}", f"r{g}{r}", 100 * 3**g) for i, (g, r) in enumerate(rows)]
)


@given(plans, st.integers(1, 12))
def test_every_picture_is_in_one_shard_whatever_the_order_of_its_twins(pictures, count) -> None:
    found = partition(pictures, OPTIONS, count)
    assert len(found.shards) == len(pictures)
    assert set(found.shards) <= set(range(count))
    assert partition([replace(each) for each in pictures], OPTIONS, count) == found


@given(plans, st.integers(1, 12))
def test_the_seconds_of_a_shard_are_those_of_its_pictures(pictures, count) -> None:
    """At most: where a group was split, passes of its pieces may be counted twice in one shard."""
    found = partition(pictures, OPTIONS, count)
    for number, own in by_shard(pictures, found).items():
        assert cost(own) <= READING * found.seconds[number]


@pytest.mark.parametrize("count", [3, 7, 16])
def test_variants_of_a_frame_stay_together_where_there_are_many_frames(count) -> None:
    """Each render and each label is made in one shard, and shards differ by no more than a frame."""
    frames = [(i, 1000 + 37 * i % 9000) for i in range(400)]
    pictures = [picture(f"v{v}", i, f"g{i}", f"r{i}", pixels) for v in range(4) for i, pixels in frames]
    found = partition(pictures, OPTIONS, count)
    at = defaultdict(set)
    for each, number in zip(pictures, found.shards, strict=True):
        at[each.frame].add(number)
    assert all(len(numbers) == 1 for numbers in at.values())
    largest = max(cost([each for each in pictures if each.index == i]) for i, _ in frames)
    assert max(found.seconds) - min(found.seconds) <= READING * largest


def test_pictures_that_share_labels_alone_are_split_by_their_renders() -> None:
    """One pose under 60 suns, each with two exposures: all share the labels."""
    pictures = [picture(f"v{v}", i, "g", f"r{i}") for v in range(2) for i in range(60)]
    found = partition(pictures, OPTIONS, 4)
    at = defaultdict(set)
    for each, number in zip(pictures, found.shards, strict=True):
        at[each.radiance].add(number)
    assert all(len(numbers) == 1 for numbers in at.values())
    assert max(found.seconds) < EQUAL * sum(found.seconds) / 4
    assert len(by_shard(pictures, found)) == 4


def test_pictures_that_share_one_render_are_split_where_nobody_else_has_work() -> None:
    pictures = [picture(f"v{v}", 0, "g", "r") for v in range(400)]
    counts = Counter(partition(pictures, OPTIONS, 4).shards)
    assert len(counts) == 4
    assert max(counts.values()) < EQUAL * 400 / 4


def test_more_shards_than_pictures_leave_some_without() -> None:
    pictures = [picture("v", i, f"g{i}", f"r{i}") for i in range(3)]
    assert len(set(partition(pictures, OPTIONS, 8).shards)) == 3


@pytest.mark.parametrize("text", ["", "1", "3/3", "-1/3", "0/0", "0/1000000", "1/2/3", "a/b", "0 / 3", "٠/٣"])
def test_what_is_no_shard_is_refused(text) -> None:
    with pytest.raises(InputError, match="there is no shard"):
        Shard.parse(text)
