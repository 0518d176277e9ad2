"""Factors on materials: from errors that are parabolas the least comes back, within limits and inside its interval."""

import numpy as np
import pytest

from spin_usd.realism.surface_fit import FARTHEST, LIMIT, SHARES, STEPS, Surfaces

PICTURES = 12
MATERIALS = {
    "Panel": {"diffuseColor": (-1.0, 0.4), "roughness": (-2.0, 0.7)},
    "Foil": {"ior": (-np.inf, np.inf)},
}
BENDS = np.array([0.3, 0.2, 0.1])
FLOOR = 0.02  # the error that no factor takes away


def errors_of(surfaces, trials, best, chance):
    """(pictures, trials) of errors that grow by the square of the distance from each picture's own best factors."""
    logs = np.log([[trial[name] for name in surfaces.parameters] for trial in trials])
    own = best + 0.02 * chance  # (pictures, parameters): pictures are not of one mind
    return FLOOR + (BENDS * np.square(logs - own[:, None])).sum(-1)


def searched(best, seed):
    """The rounds of a fit, as gap does them; returns the surfaces and the intervals."""
    surfaces, spans = Surfaces.starting(MATERIALS), []
    chance = np.random.default_rng(seed).standard_normal((PICTURES, 3))
    for step in STEPS:
        errors = errors_of(surfaces, surfaces.trials(step), best, chance)
        moved = surfaces.towards(errors, step)
        along = [surfaces.values(surfaces.logs + share * moved) for share in SHARES]
        means = errors_of(surfaces, along, best, chance).mean(0)
        spans = surfaces.intervals(errors, step)
        if means.min() < errors[:, 0].mean():
            surfaces = surfaces.moved(SHARES[int(means.argmin())] * moved)
    return surfaces, spans


def test_planted_factors_come_back_inside_their_intervals() -> None:
    """By 95 % intervals of three parameters in ten searches; the pull towards 1 is RIDGE, a hundredth of a step."""
    best, inside = np.array([0.3, -0.5, 0.2]), 0
    for seed in range(10):
        surfaces, spans = searched(best, seed)
        assert surfaces.logs == pytest.approx(best, abs=0.02)
        inside += sum(low <= np.exp(log) <= high for log, (low, high) in zip(best, spans, strict=True))
    assert inside >= 25


def test_without_a_gap_nothing_moves() -> None:
    surfaces, spans = searched(np.zeros(3), 0)
    assert surfaces.logs == pytest.approx(np.zeros(3), abs=0.02)
    assert all(low - 0.01 <= 1 <= high + 0.01 for low, high in spans)


def test_limits_are_kept() -> None:
    """The best albedo is beyond white, and the best reflection beyond a factor of 5: the search ends at the limits."""
    surfaces, _ = searched(np.array([2.0, 0.1, 3.0]), 1)
    assert surfaces.parameters == (
        "material.Panel.diffuseColor.factor", "material.Panel.roughness.factor", "material.Foil.ior.factor",
    )  # fmt: skip
    assert surfaces.limits.tolist() == [[-1.0, 0.4], [-LIMIT, 0.7], [-LIMIT, LIMIT]]
    assert surfaces.logs[0] == pytest.approx(0.4)
    assert surfaces.logs[1] == pytest.approx(0.1, abs=0.02)
    assert surfaces.logs[2] <= LIMIT
    for step in STEPS:
        for trial in surfaces.trials(step):
            logs = np.log([trial[name] for name in surfaces.parameters])
            assert (logs >= surfaces.limits[:, 0] - 1e-9).all()
            assert (logs <= surfaces.limits[:, 1] + 1e-9).all()


def test_a_parameter_at_its_limit_moves_inwards_only() -> None:
    start = Surfaces.starting(MATERIALS).moved(np.array([5.0, 0, 0]))
    assert start.logs[0] == start.limits[0, 1]
    assert start.shifts(0.2)[0] == pytest.approx([-0.4, -0.2])
    assert start.moved(np.array([-9.0, 0, 0])).shifts(0.2)[0] == pytest.approx([0.2, 0.4])
    chance = np.zeros((PICTURES, 3))
    for best, expected in ((2.0, 0.0), (0.3, -0.1)):
        away = start.towards(errors_of(start, start.trials(0.2), np.array([best, 0, 0]), chance), 0.2)
        assert away[0] == pytest.approx(expected, abs=0.01)


def test_an_interval_at_a_limit_is_not_sure_of_itself() -> None:
    """Pictures that differ in their best factor, by 0.3 around one that is inside: it is found from the limit."""
    start, step = Surfaces.starting(MATERIALS).moved(np.array([5.0, 0, 0])), STEPS[-1]
    chance = 15 * np.random.default_rng(2).standard_normal((PICTURES, 3))
    low, high = start.intervals(errors_of(start, start.trials(step), np.array([0.25, 0, 0]), chance), step)[0]
    assert low < np.exp(0.25) < high
    assert low < high <= np.exp(0.4) * 1.0001


def test_a_parabola_leads_two_steps_away_at_most() -> None:
    start = Surfaces.starting(MATERIALS)
    away = start.towards(errors_of(start, start.trials(0.1), np.array([0.3, -1.5, 0]), np.zeros((PICTURES, 3))), 0.1)
    assert away[1] == pytest.approx(-0.1 * FARTHEST)


def test_a_parameter_that_changes_nothing_stays() -> None:
    start = Surfaces.starting(MATERIALS)
    errors = np.full((PICTURES, 7), FLOOR)
    assert start.towards(errors, 0.4) == pytest.approx(np.zeros(3))


def test_what_no_picture_shows_may_be_anything() -> None:
    """Such as a roughness, to a renderer that has none."""
    start = Surfaces.starting(MATERIALS)
    errors = FLOOR + 0.001 * np.random.default_rng(0).standard_normal((PICTURES, 1)) * np.ones(7)
    errors[:, 1:3] += 0.001 * np.random.default_rng(1).uniform(1, 2, (PICTURES, 2))
    spans = start.intervals(errors, 0.1)
    assert np.ptp(spans[0]) < 0.2
    assert np.log(spans[1:]) == pytest.approx(start.limits[1:])
