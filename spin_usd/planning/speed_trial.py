"""A short piece of work whose time scales between machines as the time of pictures does.

Runs in the child that plans, which has Embree and numpy open. Nine tenths of a picture's time are Cycles' paths, which
access triangles in memory as Embree's rays do between the walls of a room, with some arithmetic at each. So this casts
rays in a hollow body. All of it fits into a processor's own caches: otherwise other work on the machine would slow it
far more than renders.
"""

import time

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.directions import sphere
from spin_usd.geometry.triangles import unit_normals, unit_vectors
from spin_usd.renderers.embree.caster import mesh_scene

ROWS = 40  # of the body's faces, twice as many around
BUMPS = 7  # around it, so that rays are soon going all ways
RAYS = 512  # at a time
BOUNCES = 96
ROUNDS = 3  # the fastest counts: other work only makes rounds longer; it is within 2 % of the fastest of many
AHEAD = 1e-4  # of the body's size: distance from a wall at which a ray starts, so that it does not meet the wall again


def trial_seconds() -> float:
    """Return the processor seconds of a round, some 0.02 s."""
    points, faces = _hollow_body()
    scene, normals = mesh_scene(points.astype(np.float32), faces), unit_normals(points[faces])
    seconds = []
    for _ in range(ROUNDS):
        began = time.thread_time()
        origins, directions = np.zeros((RAYS, 3)), sphere(RAYS)
        for _ in range(BOUNCES):
            met = np.asarray(scene.run(origins.astype(np.float32), directions.astype(np.float32)), np.int32)
            normal, corner = normals[met], points[faces[met, 0]]
            along = (directions * normal).sum(axis=1)
            origins = origins + directions * (((corner - origins) * normal).sum(axis=1) / along)[:, None]
            origins *= 1 - AHEAD
            directions = unit_vectors(directions - 2 * along[:, None] * normal)
        seconds.append(time.thread_time() - began)
    return min(seconds)


def _hollow_body() -> tuple[Float, NDArray[np.int32]]:
    """Return points (P, 3) and triangles (F, 3) of a bumpy closed body around the origin, about one in radius."""
    turn, height = np.meshgrid(np.arange(2 * ROWS) * np.pi / ROWS, np.linspace(0, np.pi, ROWS + 1))
    radius = 1 + 0.1 * np.sin(BUMPS * turn) * np.sin(height) * np.sin(BUMPS * height)
    flat = radius * np.sin(height)
    points = np.stack([flat * np.cos(turn), flat * np.sin(turn), radius * np.cos(height)], axis=-1)
    numbers = np.arange(turn.size, dtype=np.int32).reshape(turn.shape)
    here, below = numbers[:-1], numbers[1:]
    beside, across = np.roll(here, -1, axis=1), np.roll(below, -1, axis=1)
    towards_top = np.stack([here, across, beside], axis=-1)[1:]  # the poles are points: a row has half its faces there
    towards_bottom = np.stack([here, below, across], axis=-1)[:-1]
    return points.reshape(-1, 3), np.concatenate([towards_top.reshape(-1, 3), towards_bottom.reshape(-1, 3)])
