"""Factors on the inputs of materials that make renders most like real pictures, all together, by Gauss-Newton steps.

Each picture has its own light, solved again for every trial: so what all factors have in common, a brighter or darker
craft, is the light's, and only what tells materials apart is fitted (variable projection). A darker colour and a
rougher surface change pictures much alike: so all factors are solved for at once, and an interval is as wide as the
others leave it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.realism.intervals import TAILS, Interval

INPUTS = {"diffuseColor": "diffuse_color", "roughness": "roughness", "ior": "ior"}
"""Inputs of UsdPreviewSurface that a fit changes, and their fields of Material: albedo, roughness, and the strength of
the reflection."""
STEPS = (0.4, 0.2, 0.1)  # of the logarithm of a factor, round by round
FARTHEST = 2.5  # steps that a round may lead away
LIMIT = 1.6  # of the logarithm: a factor of 5
SHARES = (1.0, 0.5, 0.25)  # of a round's change that are tried
UNCHANGED = 1e-6  # of the error: less is no effect of a factor
RIDGE = 1e-3  # of the error: between equals, the factor nearest to 1
LEAST_ERROR = 1e-4  # of the squared signal
TINY = 1e-9  # of a logarithm
DRAWS = 500


@dataclass(frozen=True, kw_only=True, eq=False)
class Surfaces:
    """Logarithms of factors by parameter, and the round of the search."""

    parameters: tuple[str, ...]
    limits: Float
    """(P, 2) the least and the greatest logarithm."""
    logs: Float
    """(P,)."""

    @classmethod
    def starting(cls, materials: Mapping[str, Mapping[str, tuple[float, float]]]) -> "Surfaces":
        """Return the materials as they are. `materials`: the limits of the logarithms by the inputs that can be
        changed, by the materials' names."""
        limits = {
            f"material.{name}.{field}.factor": (max(low, -LIMIT), min(high, LIMIT))
            for name, fields in materials.items()
            for field, (low, high) in fields.items()
        }
        return cls(parameters=tuple(limits), limits=np.array(list(limits.values())), logs=np.zeros(len(limits)))

    def moved(self, by: Float) -> "Surfaces":
        """Return the surfaces with their logarithms changed by (P,), within their limits."""
        return replace(self, logs=np.clip(self.logs + by, *self.limits.T))

    def values(self, logs: Float) -> dict[str, float]:
        """Return the parameters' values, within their limits."""
        return {
            name: float(np.exp(log)) for name, log in zip(self.parameters, np.clip(logs, *self.limits.T), strict=True)
        }

    def shifts(self, step: float) -> Float:
        """Return (P,) the change of each parameter in its trial: up by `step`, or down where more room is there."""
        below, above = self.limits.T - self.logs
        up, down = np.minimum(step, above), np.maximum(-step, below)
        return np.asarray(np.where(up >= -down, up, down))

    def trials(self, step: float) -> list[dict[str, float]]:
        """Return the trials of a round: as it is, and each parameter changed alone."""
        changes = (np.zeros(len(self.logs)), *np.diag(self.shifts(step)))
        return [self.values(self.logs + change) for change in changes]

    def towards(self, products: Float, step: float) -> Float:
        """Return the changes (P,) of all parameters together that leave the least error, within FARTHEST steps.

        products: (pictures, P + 1, P + 1) of the trials' residuals, each with each, over the squared signal.
        """
        reach = FARTHEST * step
        low, high = np.clip(self.limits.T - self.logs, -reach, reach)
        return self._least(products.mean(0), self.shifts(step), low, high)

    def intervals(self, products: Float, step: float) -> list[Interval]:
        """Return the 95 % interval of each factor, all fitted together to pictures that are drawn again; its limits
        where it changes no picture."""
        rng, shifts, (low, high) = np.random.default_rng(0), self.shifts(step), self.limits.T - self.logs
        draws = rng.integers(len(products), size=(DRAWS, len(products)))
        drawn = [self._least(products[draw].mean(0), shifts, low, high) for draw in draws]
        unknown = np.diag(_normal(products.mean(0), shifts)[1]) <= UNCHANGED * _error(products.mean(0))
        ends = self.logs + np.where(unknown, (low, high), np.quantile(drawn, TAILS, axis=0))
        return [(float(least), float(most)) for least, most in np.exp(ends).T]

    def _least(self, products: Float, shifts: Float, low: Float, high: Float) -> Float:
        """Return the changes (P,) of least error between `low` and `high`."""
        from scipy.optimize import lsq_linear

        tilt, bend = _normal(products, shifts)
        pull = RIDGE * _error(products)
        values, vectors = np.linalg.eigh(bend + pull * np.eye(len(bend)))
        root = np.sqrt(np.maximum(values, pull))
        side = -vectors.T @ (tilt + pull * self.logs) / root
        free = high - low > TINY
        found = np.zeros(len(bend))
        if free.any():
            found[free] = lsq_linear((root[:, None] * vectors.T)[:, free], side, (low[free], high[free])).x
        return found


def _error(products: Float) -> float:
    """Return the error of the first trial: of products of two renders, it may come out below zero."""
    return max(float(products[0, 0]), LEAST_ERROR)


def _normal(products: Float, shifts: Float) -> tuple[Float, Float]:
    """Return the gradient (P,) and the curvature (P, P) of half the error by the parameters, at the first trial."""
    moved = products - products[0] - products[:, :1] + products[0, 0]
    steps = np.where(np.abs(shifts) > TINY, shifts, np.inf)
    return (products[0, 1:] - products[0, 0]) / steps, moved[1:, 1:] / np.outer(steps, steps)
