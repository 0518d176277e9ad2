"""The times at which an event camera's light is made: as far apart as its pictures allow.

Between two times nothing in the picture moves by more than half a pixel, and no light's strength changes by more than a
part of a threshold. Steps halve the time between two of the stage's pictures again and again, so that they do not
depend on the first picture of a run.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.transform import Transform
from spin_usd.scene.derived.light_groups import strengths
from spin_usd.scene.scene import Scene

MOST_PX = 0.5
MOST_LOG = 0.1  # of the logarithm of a light's strength
MOST_TURN = 0.5  # radians that a body may turn, as it could come back to the same place
MAX_HALVINGS = 20
DARK = 1e-12  # of a light's strength, below which it counts as dark

SceneAt = Callable[[float], Scene]
"""Reads the scene at seconds on the stage's clock."""


def time_steps(scene_at: SceneAt, pictures: Sequence[float]) -> Iterator[float]:
    """Yield the times, seconds, from the first picture's to the last one's, theirs among them."""
    yield pictures[0]
    before = scene_at(pictures[0])
    for start, end in pairwise(pictures):
        after = scene_at(end)
        yield from _halved(scene_at, start, before, end, after, MAX_HALVINGS)
        before = after


def _halved(scene_at: SceneAt, start: float, first: Scene, end: float, last: Scene, left: int) -> Iterator[float]:
    middle = (start + end) / 2
    between = scene_at(middle)
    still = moved(first, between) + moved(between, last) <= MOST_PX and turned(first, between) <= MOST_TURN
    if not left or (still and flickered(first, between) <= MOST_LOG and flickered(between, last) <= MOST_LOG):
        yield end
        return
    yield from _halved(scene_at, start, first, middle, between, left - 1)
    yield from _halved(scene_at, middle, between, end, last, left - 1)


def moved(first: Scene, last: Scene) -> float:
    """Return the largest motion between two scenes, pixels: of bodies, and of the sky behind them."""
    return max(bodies_moved(first, last), sky_moved(first, last))


def bodies_moved(first: Scene, last: Scene) -> float:
    """Return the largest motion, pixels, of the points of a body's hull that the frame could show."""
    most = 0.0
    for before, after in zip(first.one_body_scenes, last.one_body_scenes, strict=True):
        if before.region.empty and after.region.empty:
            continue
        a, b = (each.camera.project(each.T_cam_body.points(each.target.mesh.hull)) for each in (before, after))
        apart = np.hypot(*(b - a).T)
        most = max(most, float(np.nanmax(apart)) if np.isfinite(apart).any() else 0.0)
    return most


def turned(first: Scene, last: Scene) -> float:
    """Return the largest turn, radians, by a body's rates between two scenes' times."""
    rates = [float(np.linalg.norm(body.motion.angular_velocity)) for body in first.bodies if body.motion]
    if not rates or first.frame.time_s is None or last.frame.time_s is None:
        return 0.0
    return max(rates) * (last.frame.time_s - first.frame.time_s)


def sky_moved(first: Scene, last: Scene) -> float:
    """Return the largest motion, pixels, of planets' centres and of stars."""
    return first.camera.fx * max(
        (_angle(a, b) for a, b in zip(_directions(first), _directions(last), strict=True)), default=0.0
    )


def _directions(scene: Scene) -> list[Float]:
    """Return three axes of each thing in the sky, and the direction to it."""
    planets, stars = scene.environment.planets, scene.environment.stars
    turns: list[Transform] = [*(each.T_cam_planet for each in planets), *(each.T_cam_sky for each in stars)]
    places = [each.T_cam_planet.translation for each in planets]
    return [*(turn.rotation.T for turn in turns), *(place[None] / np.linalg.norm(place) for place in places)]


def _angle(first: Float, last: Float) -> float:
    """Return the largest angle between the unit vectors (N, 3) of both, radians."""
    return float(np.max(2 * np.arcsin(np.clip(np.linalg.norm(last - first, axis=1) / 2, 0, 1))))


def flickered(first: Scene, last: Scene) -> float:
    """Return the largest change of the logarithm of a light's strength."""
    a, b = strengths(first), strengths(last)
    most = 0.0
    for path in {*a, *b}:
        before, after = (np.maximum(each.get(path, (0.0, 0.0, 0.0)), DARK) for each in (a, b))
        most = max(most, float(np.abs(np.log(before / after)).max()))
    return most
