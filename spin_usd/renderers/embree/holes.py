"""Rays that go on behind faces that do not stop them: cut-outs, and those that cast no shadow of a light."""

from collections.abc import Callable

import numpy as np
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.renderers.embree.rays import Float32

BEHIND = 5e-7  # of the target's radius: how far behind a hole a ray goes on; float32 is good to 1e-7 there
FAR = 1e30  # a ray's length without an end


def first_stop(
    embree: EmbreeScene,
    origins: Float32,
    directions: Float32,
    stops: Callable[[NDArray[np.int32], Float], NDArray[np.bool_]],
    max_distance: Float32 | None = None,
) -> NDArray[np.int32]:
    """Return the first face (N,) that stops each of the rays, within its `max_distance` (N,) where given; -1 for none.

    Origins and unit directions are (N, 3). `stops` says of faces (n,) and the barycentric weights (n, 3) at which rays
    meet them whether they do. A ray goes on from just behind a face that does not; where it meets that face again, its
    start was rounded to before it, and the next step is twice as long.
    """
    face = np.full(len(origins), -1, np.int32)
    left = np.full(len(origins), FAR, np.float32) if max_distance is None else max_distance
    rays = np.arange(len(origins))
    origins, directions = origins.astype(np.float64), np.ascontiguousarray(directions)
    before, step = face.copy(), np.full(len(origins), BEHIND)
    while len(rays):
        hit = embree.run(origins[rays].astype(np.float32), directions[rays], dists=left[rays], output=True)
        met = np.flatnonzero(hit["primID"] >= 0)
        found, u, v = hit["primID"][met].astype(np.int32), *(hit[name][met].astype(np.float64) for name in "uv")
        stopped = stops(found, np.stack([1 - u - v, u, v], -1))
        face[rays[met[stopped]]] = found[stopped]
        through, found, along = rays[met[~stopped]], found[~stopped], hit["tfar"][met[~stopped]]
        step[through] = np.where(found == before[through], 2 * step[through], BEHIND)
        before[through] = found
        onward = along + step[through]
        origins[through] += onward[:, None] * directions[through]
        left[through] -= onward
        rays = through[left[through] > 0]
    return face
