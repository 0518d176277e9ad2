"""The strengths of lights that make a render most like a real picture.

Light is additive: a picture is a sum of the renders of its lights, each times a strength of zero or more. So the fit is
a non-negative least squares problem. A saturated pixel only bounds the light from below: it counts where the fit is
darker.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

ROUNDS = 8  # of saturated pixels that count or not
STEADY = 1e-9  # of the normal matrix's trace, added to its diagonal
NEGLIGIBLE = 0.01  # of the squared light: what a fit may lose by a light fewer
TILE = 24  # pixels a side: a block of the bootstrap, as residuals of near pixels are alike
DRAWS = 200
TAILS = (0.025, 0.975)


@dataclass(frozen=True, kw_only=True, eq=False)
class LightFit:
    """Strengths of lights, and how sure they are."""

    strengths: Float
    """(N,) zero or more."""
    low: Float
    """(N,) lower end of the 95 % interval."""
    high: Float


def fit_light(
    basis: NDArray[np.float32], signal: NDArray[np.float32], mask: NDArray[np.bool_], full: NDArray[np.bool_]
) -> LightFit:
    """Fit the picture of N lights.

    basis (N, H, W): the picture in each light of strength 1 · signal (H, W): the real picture, in the same unit · mask
    (H, W): the pixels that count · full (H, W): the pixels that are saturated, where `signal` is a lower bound.
    """
    a, b, tiles = basis[:, mask].T.astype(np.float64), signal[mask].astype(np.float64), _tiles(mask)
    bound, used = full[mask], np.ones(int(mask.sum()), bool)
    if bound.all() or not len(b):
        used, bound = np.ones(len(b), bool), np.zeros(len(b), bool)
    used &= ~bound
    strengths = np.zeros(len(basis))
    for _ in range(ROUNDS):
        strengths = _solved(a[used].T @ a[used], a[used].T @ b[used])
        next_used = ~bound | (a @ strengths < b)
        if (next_used == used).all():
            break
        used = next_used
    few = _fewest(a[used], b[used], strengths)
    low, high = _interval(a[used][:, few], b[used], tiles[used])
    found, lower, upper = (np.zeros(len(basis)) for _ in range(3))
    found[few] = _solved(*_normal(a[used][:, few], b[used]))
    lower[few], upper[few] = low, high
    return LightFit(strengths=found, low=lower, high=upper)


def _fewest(a: Float, b: Float, strengths: Float) -> NDArray[np.intp]:
    """Return the fewest lights, the strongest first, that fit nearly as well as all of them."""
    order = np.argsort(-strengths * a.sum(0), kind="stable")
    order = order[strengths[order] > 0]
    best, whole = _residual(a[:, order], b), float(b @ b)
    for count in range(1, len(order)):
        if _residual(a[:, order[:count]], b) <= best + NEGLIGIBLE * whole:
            return order[:count]
    return order


def _residual(a: Float, b: Float) -> float:
    left = b - a @ _solved(*_normal(a, b))
    return float(left @ left)


def _interval(a: Float, b: Float, tiles: NDArray[np.intp]) -> tuple[Float, Float]:
    """Return the interval of each strength by drawing tiles of the picture again."""
    if not a.shape[1]:
        return np.zeros(0), np.zeros(0)
    parts = [_normal(a[tiles == tile], b[tiles == tile]) for tile in np.unique(tiles)]
    matrices, sides = (np.stack(each) for each in zip(*parts, strict=True))
    rng, drawn = np.random.default_rng(0), []
    for _ in range(DRAWS):
        counts = rng.multinomial(len(parts), np.full(len(parts), 1 / len(parts)))
        drawn.append(_solved(np.tensordot(counts, matrices, 1), np.tensordot(counts, sides, 1)))
    low, high = np.quantile(drawn, TAILS, axis=0)
    return low, high


def _normal(a: Float, b: Float) -> tuple[Float, Float]:
    return a.T @ a, a.T @ b


def _solved(matrix: Float, side: Float) -> Float:
    """Return the non-negative x (N,) of least |A x - b|, from AᵀA and Aᵀb."""
    from scipy.optimize import nnls

    if not len(side) or not matrix.any():
        return np.zeros(len(side))
    root = np.linalg.cholesky(matrix + STEADY * np.trace(matrix) * np.eye(len(matrix)))
    found: Float = nnls(root.T, np.linalg.solve(root, side), maxiter=30 * len(side))[0]
    return found


def _tiles(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the tile of each pixel of the mask."""
    rows, columns = np.nonzero(mask)
    return np.asarray(rows // TILE * (mask.shape[1] // TILE + 1) + columns // TILE)
