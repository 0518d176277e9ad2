"""Partition a run's pictures into shards: equal work for each, and no render or label made twice where that can be.

Every shard is a command of its own and computes the same partition: it follows from the plan alone, whose numbers come
from the stage and the options, and never from what is on disk or what a machine measured. Costs are whole microseconds,
for sums of floats depend on their order.
"""

import heapq
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from spin_usd.picture.make_picture import BEAM_PASS, BEAUTY_PASS, LABEL_PASS
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import expected_work
from spin_usd.planning.work import CommonWork, Task

OF_LABELS = (LABEL_PASS, BEAM_PASS, "labels")
FINENESS = (1, 4, 16, 64)
"""Pictures that share passes are split where they cost more than one of so many parts of a shard's equal share, ..."""
WORTH = 0.02
"""... if that makes the longest shard shorter by this share of it."""


@dataclass(frozen=True, kw_only=True)
class Partition:
    """A partition of a plan.

    shards: the number of each picture's shard · seconds: what each shard is expected to take, on one core.
    """

    shards: tuple[int, ...]
    seconds: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class _Picture:
    """A picture: its place in the plan, the keys of its labels and of its render, and microseconds of the passes that
    make these, and of all else."""

    place: int
    labels: tuple[str, ...]
    render: str
    label_pass: int
    render_pass: int
    rest: int


@dataclass(frozen=True, kw_only=True)
class _Group:
    """Pictures that stay together, and microseconds that they cost."""

    pictures: Sequence[_Picture]
    cost: int


def partition(pictures: Sequence[PlannedPicture], options: CommonWork, count: int) -> Partition:
    """Partition the pictures into `count` shards.

    Pictures that share a render or a label go into one shard together; where there are so many of them that shards come
    out unequal, those that share a render do, and then no longer all of these.
    """
    listed = [_picture(place, picture, options) for place, picture in enumerate(pictures)]
    whole = [_group(each) for each in _together(listed, lambda picture: (*picture.labels, picture.render))]
    best, equal = _dealt(whole, count), sum(group.cost for group in whole) // count
    for fineness in FINENESS:
        limit = equal // fineness
        if any(group.cost > limit and len(group.pictures) > 1 for group in whole):
            finer = _dealt([piece for group in whole for piece in _pieces(group, limit)], count)
            best = finer if _longest(finer) < (1 - WORTH) * _longest(best) else best
    shards = {picture.place: number for number, hand in enumerate(best) for group in hand for picture in group.pictures}
    seconds = (sum(group.cost for group in hand) / 1e6 for hand in best)
    return Partition(shards=tuple(shards[place] for place in range(len(listed))), seconds=tuple(seconds))


def _picture(place: int, picture: PlannedPicture, options: CommonWork) -> _Picture:
    work = expected_work(Task(picture=picture, label_pass=bool(options.labels), render=options.renders), options)
    labels, render = sum(work.get(kind, 0.0) for kind in OF_LABELS), work.get(BEAUTY_PASS, 0.0)
    return _Picture(
        place=place,
        labels=tuple(sorted({picture.label_key(kind) for kind in options.labels})),
        render=picture.radiance if options.renders else picture.name,
        label_pass=round(1e6 * labels),
        render_pass=round(1e6 * render),
        rest=round(1e6 * (sum(work.values()) - labels - render)),
    )


def _group(pictures: Sequence[_Picture]) -> _Group:
    return _Group(pictures=pictures, cost=_cost(pictures, set()))


def _cost(pictures: Sequence[_Picture], made: set[str]) -> int:
    """Return what the pictures cost one after the other where those passes are `made`, and add their own to them."""
    cost = 0
    for picture in pictures:
        cost += picture.rest
        cost += 0 if made.issuperset(picture.labels) else picture.label_pass
        cost += 0 if picture.render in made else picture.render_pass
        made.update(picture.labels, [picture.render])
    return cost


def _together(pictures: Sequence[_Picture], keys: Callable[[_Picture], Sequence[str]]) -> list[list[_Picture]]:
    """Return the pictures in groups, such that no two groups share a key; groups and pictures in the plan's order."""
    parent: dict[str, str] = {}

    def root(key: str) -> str:
        while (above := parent.setdefault(key, key)) != key:
            key = parent[key] = parent[above]
        return key

    for picture in pictures:
        first, *others = keys(picture)
        for key in others:
            parent[root(key)] = root(first)
    groups = defaultdict[str, list[_Picture]](list)
    for picture in pictures:
        groups[root(keys(picture)[0])].append(picture)
    return list(groups.values())


def _pieces(group: _Group, limit: int) -> Iterator[_Group]:
    """Split a group that costs more than `limit` into pieces of about that, or of a single picture."""
    if group.cost <= limit:
        yield group
        return
    piece: list[_Picture] = []
    cost, made = 0, set[str]()
    for unit in _units(group, limit):
        more = _cost(unit, made)
        if piece and cost + more > limit:
            yield _Group(pictures=piece, cost=cost)
            piece, cost, made = [], 0, set()
            more = _cost(unit, made)
        piece += unit
        cost += more
    yield _Group(pictures=piece, cost=cost)


def _units(group: _Group, limit: int) -> Iterator[list[_Picture]]:
    """Yield the pictures of the group that share a render, each alone where even those cost more than `limit`."""
    for sharing in _together(group.pictures, lambda picture: (picture.render,)):
        yield from [sharing] if _group(sharing).cost <= limit else [[picture] for picture in sharing]


def _dealt(groups: Sequence[_Group], count: int) -> list[list[_Group]]:
    """Deal the groups out, the costliest first, each to the shard that has the least (Graham, 1969: the longest shard
    takes at most 4/3 of what the best deal takes)."""
    hands: list[list[_Group]] = [[] for _ in range(count)]
    loads = [(0, number) for number in range(count)]
    for group in sorted(groups, key=lambda group: (-group.cost, group.pictures[0].place)):
        load, number = loads[0]
        hands[number].append(group)
        heapq.heapreplace(loads, (load + group.cost, number))
    return hands


def _longest(hands: Sequence[Sequence[_Group]]) -> int:
    return max(sum(group.cost for group in hand) for hand in hands)
