"""Factors on materials: from residuals that are linear in them, the best come back, within limits and intervals."""

import numpy as np
import pytest

from spin_usd.realism.surface_fit import FARTHEST, LIMIT, SHARES, STEPS, Surfaces

PICTURES = 12
MATERIALS = {
    "Panel": {"diffuseColor": (-1.0, 0.4), "roughness": (-2.0, 0.7)},
    "Foil": {"ior": (-np.inf, np.inf)},
}
PIXELS = 400
ALIKE = 0.8  # correlation of the changes that albedo and roughness of the panel make
FLOOR = 0.15  # the residual that no factor takes away: of pixels, over the signal


def products_of(surfaces, trials, best, seed, alike=ALIKE, spread=0.02):
    """(pictures, trials, trials) of residuals that are linear in the factors' logarithms; each picture has best factors
    of its own, with that `spread`."""
    chance = np.random.default_rng(seed)
    changes = chance.standard_normal((PICTURES, PIXELS, 3)) / PIXELS**0.5
    changes[..., 1] = alike * changes[..., 0] + (1 - alike**2) ** 0.5 * changes[..., 1]
    changes *= (0.5, 0.4, 0.3)
    own = best + spread * chance.standard_normal((PICTURES, 3))
    left = FLOOR * chance.standard_normal((PICTURES, 1, PIXELS)) / PIXELS**0.5
    logs = np.log([[trial[name] for name in surfaces.parameters] for trial in trials])
    residuals = left + np.einsum("ptk,pnk->ptn", logs - own[:, None], changes)
    return residuals @ residuals.swapaxes(1, 2)


def searched(best, seed, **how):
    """The rounds of a fit, as gap does them; returns the surfaces and the intervals."""
    surfaces, spans = Surfaces.starting(MATERIALS), []
    for step in STEPS:
        products = products_of(surfaces, surfaces.trials(step), best, seed, **how)
        moved = surfaces.towards(products, step)
        along = [surfaces.values(surfaces.logs + share * moved) for share in SHARES]
        means = np.diagonal(products_of(surfaces, along, best, seed, **how).mean(0))
        spans = surfaces.intervals(products, step)
        if means.min() < products[:, 0, 0].mean():
            surfaces = surfaces.moved(SHARES[int(means.argmin())] * moved)
    return surfaces, spans


def test_planted_factors_come_back_inside_their_intervals() -> None:
    """By 95 % intervals of three parameters in twenty searches, two of which change pictures much alike."""
    best, inside = np.array([0.3, -0.5, 0.2]), 0
    for seed in range(20):
        surfaces, spans = searched(best, seed)
        assert surfaces.logs == pytest.approx(best, abs=0.15)
        inside += sum(low <= np.exp(log) <= high for log, (low, high) in zip(best, spans, strict=True))
    assert inside >= 52


def test_an_interval_is_as_wide_as_the_other_factors_leave_it() -> None:
    """Least squares: what two parameters share widens both, by the root of 1 - alike**2."""
    widths = []
    for alike in (0.0, 0.95):
        spans = [searched(np.zeros(3), seed, alike=alike, spread=0)[1] for seed in range(6)]
        widths.append(np.mean([np.log(high / low) for (low, high), *_ in spans]))
    assert widths[1] / widths[0] == pytest.approx((1 - 0.95**2) ** -0.5, rel=0.35)


def test_without_a_gap_nothing_moves() -> None:
    surfaces, spans = searched(np.zeros(3), 0)
    assert surfaces.logs == pytest.approx(np.zeros(3), abs=0.05)
    assert all(low - 0.05 <= 1 <= high + 0.05 for low, high in spans)


def test_limits_are_kept() -> None:
    """The best albedo is beyond white, and the best reflection beyond a factor of 5: the search ends at the limits."""
    surfaces, _ = searched(np.array([2.0, 0.1, 3.0]), 1)
    assert surfaces.parameters == (
        "material.Panel.diffuseColor.factor", "material.Panel.roughness.factor", "material.Foil.ior.factor",
    )  # fmt: skip
    assert surfaces.limits.tolist() == [[-1.0, 0.4], [-LIMIT, 0.7], [-LIMIT, LIMIT]]
    assert surfaces.logs[0] == pytest.approx(0.4)
    assert surfaces.logs[2] <= LIMIT
    for step in STEPS:
        for trial in surfaces.trials(step):
            logs = np.log([trial[name] for name in surfaces.parameters])
            assert (logs >= surfaces.limits[:, 0] - 1e-9).all()
            assert (logs <= surfaces.limits[:, 1] + 1e-9).all()


def test_a_parameter_at_its_limit_is_tried_inwards() -> None:
    start = Surfaces.starting(MATERIALS).moved(np.array([5.0, 0, 0]))
    assert start.logs[0] == start.limits[0, 1]
    assert start.shifts(0.2) == pytest.approx([-0.2, 0.2, 0.2])
    for best, expected in ((2.0, 0.0), (0.3, -0.1)):
        away = start.towards(products_of(start, start.trials(0.2), np.array([best, 0, 0]), 0), 0.2)
        assert away[0] == pytest.approx(expected, abs=0.06)


def test_a_round_leads_a_few_steps_away_at_most() -> None:
    start = Surfaces.starting(MATERIALS)
    away = start.towards(products_of(start, start.trials(0.1), np.array([0.0, 0, -1.5]), 0), 0.1)
    assert away[2] == pytest.approx(-0.1 * FARTHEST)


def test_an_error_below_zero_is_none() -> None:
    """The products of two renders' residuals are errors without noise, on average alone."""
    start = Surfaces.starting(MATERIALS)
    products = products_of(start, start.trials(0.1), np.array([0.1, 0, 0.1]), 0) - 1.5 * FLOOR**2
    assert products[:, 0, 0].mean() < 0
    assert start.towards(products, 0.1)[[0, 2]] == pytest.approx([0.1, 0.1], abs=0.15)
    assert all(low < high for low, high in start.intervals(products, 0.1))


def test_what_no_picture_shows_stays_and_may_be_anything() -> None:
    """Such as a roughness, to a renderer that has none."""
    start = Surfaces.starting(MATERIALS)
    products = products_of(start, start.trials(0.1), np.array([0.1, 0, 0]), 0)
    products[:, 2:] = products[:, :1]
    products[:, :, 2:] = products[:, :, :1]
    assert start.towards(products, 0.1)[1:] == pytest.approx([0, 0])
    spans = start.intervals(products, 0.1)
    assert np.log(spans[0]) == pytest.approx([0.1, 0.1], abs=0.1)
    assert np.log(spans[1:]) == pytest.approx(start.limits[1:])
