"""The rotation, translation and scale that lay a reconstruction on the true shape, from any attitude.

Many starts, of the principal axes of both, are tried by trimmed ICP with pairs of nearest points in both directions, so
that a small scale gains nothing; the best are refined by distances from the planes of the true points, of which great
ones count less.
Sources: Umeyama 1991 (similarity of pairs), Chetverikov et al. 2002 (trimmed ICP), Chen and Medioni 1991 (planes).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

KEPT = 0.8  # of the pairs in each direction: the nearest ones
FEW, SOME, MANY = 400, 3000, 20_000  # points of each stage
COARSE, FINE, LAST = 15, 15, 40  # steps of each stage
WIDTH = 2.4  # of the median distance from the planes, at which a pair counts half
BEST = 8  # starts that are refined
STILL = 1e-10  # of the size: a smaller step ends it


class Similarity(NamedTuple):
    """A point x goes to scale R x + t."""

    scale: float
    R: Float
    """(3, 3) a rotation."""
    t: Float
    """(3,)."""

    def points(self, points: Float) -> Float:
        """Return the points (N, 3) moved."""
        moved: Float = self.scale * points @ self.R.T + self.t
        return moved

    def after(self, first: "Similarity") -> "Similarity":
        """Return the similarity that moves points by `first`, then by this one."""
        return Similarity(self.scale * first.scale, self.R @ first.R, self.points(first.t[None])[0])


def aligned(
    points: Float, truth: Float, normals: Float, *, scaled: bool, rng: np.random.Generator
) -> Similarity | None:
    """Return the similarity, or without `scaled` the rigid motion, that lays `points` (N, 3) on the points `truth`
    (M, 3) with these `normals`; None where the points have no extent."""
    unit, own = _normal_form(truth), _normal_form(points)
    if own.scale == np.inf:
        return None
    if not scaled:
        own = Similarity(unit.scale, own.R, own.t / own.scale * unit.scale)
    there, here, across = unit.points(truth), own.points(points), normals @ unit.R.T
    chosen, true = rng.permutation(len(here)), rng.permutation(len(there))
    clouds = _Clouds(here[chosen[:FEW]], there[true[:FEW]])
    coarse = [_coarse(clouds, R, scaled=scaled) for R in _starts()]
    best = sorted(coarse, key=lambda each: each[0])[:BEST]
    for steps, count in ((FINE, SOME), (LAST, MANY)):
        some = true[:count]
        clouds = _Clouds(here[chosen[:count]], there[some])
        refined = [_fine(clouds, across[some], each, steps, scaled=scaled) for _, each in best]
        best = sorted(refined, key=lambda each: each[0])[:1]
    return _inverse(unit).after(best[0][1]).after(own)


class _Clouds:
    """Points (N, 3) that are moved, and points (M, 3) where they belong."""

    def __init__(self, here: Float, there: Float) -> None:
        from scipy.spatial import KDTree  # not above: it takes long to load

        self.here, self.there = here, there
        self._trees = KDTree(here), KDTree(there)

    def pairs(self, move: Similarity) -> tuple[Float, Float, NDArray[np.intp], float]:
        """Return the kept pairs of nearest points in both directions: (K, 3) moved by `move`, (K, 3) where they belong
        and the places of these (K,), and the mean of the kept distances."""
        of_here, of_there = self._trees
        moved = move.points(self.here)
        apart, place = (np.asarray(each) for each in of_there.query(moved))
        kept = np.argsort(apart)[: max(round(KEPT * len(moved)), 1)]
        back, own = (np.asarray(each) for each in of_here.query(_inverse(move).points(self.there)))
        held = np.argsort(back)[: max(round(KEPT * len(back)), 1)]
        mine, its = np.concatenate([kept, own[held]]), np.concatenate([place[kept], held])
        mean = float(apart[kept].mean() + move.scale * back[held].mean()) / 2
        return moved[mine], self.there[its], its, mean


def _normal_form(points: Float) -> Similarity:
    """Return the similarity that moves the middle of the points to 0, their median distance from it to 1, and their
    principal axes to x, y and z; of infinite scale where they have no extent."""
    middle = np.median(points, axis=0)
    apart = np.linalg.norm(points - middle, axis=1)
    size = float(np.median(apart)) or float(apart.max())
    near = points[apart <= 3 * size] - middle  # without strays
    axes = np.linalg.svd(near.T @ near)[0]
    axes[:, 2] *= np.linalg.det(axes)
    scale = 1 / size if size else np.inf
    return Similarity(scale, axes.T, -scale * axes.T @ middle if size else middle)


def _starts() -> Float:
    """Return (84, 3, 3) rotations: the exchanges and flips of axes, and those of an icosahedron."""
    from scipy.spatial.transform import Rotation

    groups = (Rotation.create_group(name).as_matrix() for name in ("O", "I"))
    return np.concatenate([*groups])


def _coarse(clouds: _Clouds, R: Float, *, scaled: bool) -> tuple[float, Similarity]:
    """Return the mean distance of kept pairs, and the similarity that ICP reaches from the rotation `R`."""
    found = Similarity(1.0, R, np.zeros(3))
    for _ in range(COARSE):
        mine, its, _, apart = clouds.pairs(found)
        a, b = mine - mine.mean(0), its - its.mean(0)
        U, sizes, Vt = np.linalg.svd(b.T @ a)
        flip = np.array([1, 1, np.linalg.det(U @ Vt)])
        scale = float((sizes * flip).sum() / (a * a).sum()) if scaled and a.any() else 1.0
        turn = U * flip @ Vt
        found = Similarity(scale, turn, its.mean(0) - scale * turn @ mine.mean(0)).after(found)
    return apart, found


def _fine(clouds: _Clouds, across: Float, start: Similarity, steps: int, *, scaled: bool) -> tuple[float, Similarity]:
    """Return the mean distance of kept pairs, and the similarity that least squares of distances from the planes of the
    true points reach from `start`."""
    from scipy.spatial.transform import Rotation

    found = start
    for _ in range(steps):
        mine, its, place, apart = clouds.pairs(found)
        normals = across[place]
        columns = [np.cross(mine, normals), normals, (mine * normals).sum(1, keepdims=True)]
        matrix = np.concatenate(columns if scaled else columns[:2], axis=1)
        off = ((its - mine) * normals).sum(1)
        weight = 1 / np.hypot(1, off / max(WIDTH * float(np.median(np.abs(off))), STILL))  # square root of Cauchy's
        step = np.linalg.lstsq(matrix * weight[:, None], off * weight, rcond=1e-8)[0]
        turn = Rotation.from_rotvec(step[:3]).as_matrix()
        found = Similarity(float(np.exp(step[6])) if scaled else 1.0, turn, step[3:6]).after(found)
        if np.abs(step).max() < STILL:
            break
    return apart, found


def _inverse(of: Similarity) -> Similarity:
    return Similarity(1 / of.scale, of.R.T, -of.R.T @ of.t / of.scale)
