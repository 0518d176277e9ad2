"""The part of a plan that a shard makes, and the manifest that it shares with the others."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.manifest import Manifest, digest_of
from spin_usd.planning.partition import partition
from spin_usd.planning.shard import Shard
from spin_usd.planning.work import CommonWork
from spin_usd.scene.effort import CPU


def plan_of_shard(
    plan: Plan, shard: Shard, options: CommonWork, *, named: Mapping[str, Any], stage: Path
) -> tuple[Plan, Manifest]:
    """Return the plan of the shard's pictures alone, and the manifest of all shards. `stage`: the folder of the
    planned stage's files · `named`: options that records say by name."""
    numbers = partition(plan.pictures, options, shard.count).shards
    own = (picture for picture, number in zip(plan.pictures, numbers, strict=True) if number == shard.number)
    settings = {
        "renderer": plan.settings.renderer,
        "effort": asdict(plan.settings.effort),
        "seed": plan.settings.seed,
        **({"device": plan.settings.device} if plan.settings.device != CPU else {}),
        "kinds": list(options.kinds),
        **named,
    }
    manifest = Manifest(
        count=shard.count,
        stage=digest_of(stage),
        settings=settings,
        shards=_by_name(plan.pictures, numbers),
    )
    return replace(plan, pictures=tuple(own)), manifest


def _by_name(pictures: Sequence[PlannedPicture], numbers: Sequence[int]) -> dict[str, dict[str, int]]:
    found = defaultdict[str, dict[str, int]](dict)
    for picture, number in zip(pictures, numbers, strict=True):
        found[picture.variant][picture.frame] = number
    return dict(found)
