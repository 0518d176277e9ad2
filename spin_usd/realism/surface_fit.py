"""Factors on the inputs of materials that make renders most like real pictures, by parabolas through three renders.

Each picture has its own light, solved again for every trial: so what all factors have in common, a brighter or darker
craft, is the light's, and only what tells materials apart is fitted.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.realism.intervals import Interval, interval

INPUTS = {"diffuseColor": "diffuse_color", "roughness": "roughness", "ior": "ior"}
"""Inputs of UsdPreviewSurface that a fit changes, and their fields of Material: albedo, roughness, and the strength of
the reflection."""
STEPS = (0.4, 0.2, 0.1)  # of the logarithm of a factor, round by round
FARTHEST = 2.0  # steps that a parabola may lead away
LIMIT = 1.6  # of the logarithm: a factor of 5
SHARES = (1.0, 0.5, 0.25)  # of the step along all parabolas at once that are tried
NEAR = 0.1  # of a step: a limit that is nearer leaves no room for a trial
UNCHANGED = 1e-6  # of the error: less is no effect of a factor
RIDGE = 1e-3  # of the error: between equals, the factor nearest to 1


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
        """Return (P, 2) the changes of a round's trials: down and up by `step`, or by less where a limit is near; from
        a limit, one step and two inwards, for a parabola has three points."""
        low, high = self.limits.T - self.logs
        both = np.stack([np.maximum(-step, low), np.minimum(step, high)], -1)
        downwards = np.stack([np.maximum(-2 * step, low), np.maximum(-step, low / 2)], -1)
        upwards = np.stack([np.minimum(step, high / 2), np.minimum(2 * step, high)], -1)
        at_least, at_most = (-low < NEAR * step)[:, None], (high < NEAR * step)[:, None]
        return np.where(at_most, downwards, np.where(at_least, upwards, both))

    def trials(self, step: float) -> list[dict[str, float]]:
        """Return the trials of a round: as it is, and each parameter lower and higher."""
        each = np.eye(len(self.logs))
        changes = [unit * shift for unit, pair in zip(each, self.shifts(step), strict=True) for shift in pair]
        return [self.values(self.logs + change) for change in (np.zeros(len(self.logs)), *changes)]

    def towards(self, errors: Float, step: float) -> Float:
        """Return the changes (P,) to the least of each parameter's parabola; errors (pictures, trials)."""
        means, shifts = errors.mean(0), self.shifts(step)
        table = np.stack([np.full(len(self.logs), means[0]), means[1::2], means[2::2]], -1)
        away = self.logs[:, None] + np.column_stack([np.zeros(len(self.logs)), shifts])
        return np.clip(_least(table + RIDGE * means[0] * np.square(away), shifts), *(self.limits.T - self.logs))

    def intervals(self, errors: Float, step: float) -> list[Interval]:
        """Return the 95 % interval of each factor, drawing the pictures of a round's `errors` again: all that it may be
        where it changes no picture."""
        found = []
        for place, (log, shifts) in enumerate(zip(self.logs, self.shifts(step), strict=True)):
            of = errors[:, [0, 1 + 2 * place, 2 + 2 * place]]
            if np.ptp(of, axis=1).max() <= UNCHANGED * of.mean():
                low, high = np.exp(self.limits[place])
                found.append((float(low), float(high)))
                continue

            def drawn(draws: Float, of: Float = of, shifts: Float = shifts) -> Float:
                return _least(of[draws.astype(np.intp)].mean(1), np.broadcast_to(shifts, (len(draws), 2)))

            _, (low, high) = interval(np.arange(len(of), dtype=np.float64), drawn)
            ends = np.clip((log + low, log + high), *self.limits[place])
            found.append((float(np.exp(ends[0])), float(np.exp(ends[1]))))
        return found


def _least(table: Float, shifts: Float) -> Float:
    """Return (M,) the places of the least of parabolas through (M, 3) errors at 0 and at the `shifts` (M, 2), one down
    and one up, or both to one side: within FARTHEST times the shifts, and at the lower end of what has no parabola."""
    middle, low, high = np.moveaxis(table, -1, 0)
    down, up = shifts.T
    with np.errstate(divide="ignore", invalid="ignore"):
        slope_down, slope_up = (low - middle) / down, (high - middle) / up
        bend = (slope_up - slope_down) / (up - down)
        tilt = slope_up - bend * up
        least = -tilt / (2 * bend)
    ends = np.where((low < middle) | (high < middle), np.where(low < high, down, up), 0.0)
    good = (bend > 0) & np.isfinite(least)
    nearest, farthest = np.minimum(FARTHEST * down, 0), np.maximum(FARTHEST * up, 0)
    found: Float = np.where(good, np.clip(least, nearest, farthest), ends)
    return found
