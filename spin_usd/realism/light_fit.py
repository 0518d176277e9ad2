"""The strengths of lights that make a render most like a real picture.

Light is additive: a picture is a sum of the renders of its lights, each times a strength of zero or more. So the fit is
a non-negative least squares problem. A saturated pixel only bounds the light from below: it counts where the fit is
darker. The renders have noise of their own, which would make all strengths too small: so there are two of each light,
and their products, in which the noise has no mean, take the place of squares (W. Fuller, "Measurement Error Models",
1987).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

ROUNDS = 8  # of saturated pixels that count or not
TIE = 1e-3  # of a bound: a fit that only reaches it still needs it, or without it would fall below again
STEADY = 1e-5  # of the largest eigenvalue of the normal matrix: none is smaller
NEGLIGIBLE = 0.01  # of the squared light: what a fit may lose by a light fewer
TILE = 12  # pixels a side: a block of the bootstrap, as residuals of near pixels are alike
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
    basis: NDArray[np.float32],
    signal: NDArray[np.float32],
    mask: NDArray[np.bool_],
    full: NDArray[np.bool_],
    *,
    spare: NDArray[np.bool_],
) -> LightFit:
    """Fit the picture of N lights, of the spare ones as few as fit well.

    basis (2, N, H, W): the picture in each light of strength 1, two renders with other noise · signal (H, W): the real
    picture, in the same unit · mask (H, W): the pixels that count · full (H, W): the pixels that are saturated, where
    `signal` is a lower bound · spare (N,): the lights that may be left out.
    """
    a = basis[:, :, mask].transpose(0, 2, 1).astype(np.float64)
    b, tiles, mean = signal[mask].astype(np.float64), _tiles(mask), a.mean(0)
    bound, used = full[mask], np.ones(int(mask.sum()), bool)
    if bound.all():
        bound = np.zeros(len(b), bool)
    used &= ~bound
    strengths = np.zeros(basis.shape[1])
    for _ in range(ROUNDS):
        strengths = _solved(*_normal(a[:, used], b[used]))
        next_used = ~bound | (mean @ strengths < b * (1 + TIE))
        if (next_used == used).all():
            break
        used = next_used
    a, b = a[:, used], b[used]
    few = np.append(np.flatnonzero(~spare), _fewest(a, b, np.flatnonzero(spare)))
    low, high = _interval(a[:, :, few], b, tiles[used])
    found, lower, upper = (np.zeros(basis.shape[1]) for _ in range(3))
    found[few] = _solved(*_normal(a[:, :, few], b))
    lower[few], upper[few] = low, high
    return LightFit(strengths=found, low=lower, high=upper)


def _fewest(a: Float, b: Float, lights: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the fewest of these lights, the strongest first, that by themselves fit nearly as well as all of them."""
    (matrix, side), whole = _normal(a, b), float(b @ b)

    def fitted(some: NDArray[np.intp]) -> tuple[Float, float]:
        x = _solved(matrix[np.ix_(some, some)], side[some])
        return x, float(2 * x @ side[some] - x @ matrix[np.ix_(some, some)] @ x)

    strengths, best = fitted(lights)
    given = strengths * a[:, :, lights].sum((0, 1))
    order = lights[np.argsort(-given, kind="stable")[: int((strengths > 0).sum())]]
    counts = (count for count in range(1, len(order)) if fitted(order[:count])[1] >= best - NEGLIGIBLE * whole)
    return order[: next(counts, len(order))]


def _interval(a: Float, b: Float, tiles: NDArray[np.intp]) -> tuple[Float, Float]:
    """Return the interval of each strength by drawing tiles of the picture again."""
    if not a.shape[-1] or not len(b):
        return np.zeros(a.shape[-1]), np.zeros(a.shape[-1])
    parts = [_normal(a[:, tiles == tile], b[tiles == tile]) for tile in np.unique(tiles)]
    matrices, sides = (np.stack(each) for each in zip(*parts, strict=True))
    rng, drawn = np.random.default_rng(0), []
    for _ in range(DRAWS):
        counts = rng.multinomial(len(parts), np.full(len(parts), 1 / len(parts)))
        drawn.append(_solved(np.tensordot(counts, matrices, 1), np.tensordot(counts, sides, 1)))
    low, high = np.quantile(drawn, TAILS, axis=0)
    return low, high


def _normal(a: Float, b: Float) -> tuple[Float, Float]:
    """Return AᵀA (N, N) and Aᵀb (N,) of two renders a (2, pixels, N), without their noise."""
    product = a[0].T @ a[1]
    return (product + product.T) / 2, a.mean(0).T @ b


def _solved(matrix: Float, side: Float) -> Float:
    """Return the non-negative x (N,) of least |A x - b|, from AᵀA and Aᵀb."""
    from scipy.optimize import nnls

    if not len(side) or not matrix.any():
        return np.zeros(len(side))
    values, vectors = np.linalg.eigh(matrix)
    root = np.sqrt(np.maximum(values, STEADY * max(float(values.max()), 0.0)))
    found: Float = nnls(root[:, None] * vectors.T, vectors.T @ side / root, maxiter=30 * len(side))[0]
    return found


def _tiles(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the tile of each pixel of the mask."""
    rows, columns = np.nonzero(mask)
    return np.asarray(rows // TILE * (mask.shape[1] // TILE + 1) + columns // TILE)
