"""Draws: their distributions held against SciPy's, and that each depends on its own name alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from spin_usd.errors import InputError
from spin_usd.sampling.sample import Sample, distribution_of, sample_all, sample_one

N = 4000
MIN_P = 1e-3  # seeds are fixed: a test that passes once passes always
FRAMES = [f"img{i:06d}" for i in range(N)]


def sampled(words, factor=1.0, name="a"):
    sample = Sample(parameter="p", distribution=distribution_of(words, factor), per_frame=True)
    return np.array(sample_all([sample], seed=3, name=name, frames=FRAMES).per_frame["p"])


@pytest.mark.parametrize(
    ("words", "law"),
    [
        ({"distribution": "uniform", "low": -2, "high": 5}, stats.uniform(-2, 7)),
        ({"distribution": "log_uniform", "low": 0.01, "high": 10}, stats.loguniform(0.01, 10)),
        ({"distribution": "normal", "mean": 3, "sigma": 2}, stats.norm(3, 2)),
        ({"distribution": "normal", "mean": 0, "sigma": 1, "low": -1, "high": 2}, stats.truncnorm(-1, 2)),
    ],
)
def test_numbers_are_distributed_as_scipys(words, law) -> None:
    assert stats.kstest(sampled(words), law.cdf).pvalue > MIN_P


def test_units_scale_the_distribution_as_a_whole() -> None:
    words = {"distribution": "normal", "mean": 2, "sigma": 0.5, "low": 1}
    np.testing.assert_allclose(sampled(words, factor=1000), 1000 * sampled(words), rtol=1e-8)


def test_directions_are_alike_in_solid_angle() -> None:
    d = sampled({"distribution": "directions", "axis": [1, 2, -2], "least": 20, "most": 120})
    cosines = d @ np.array([1, 2, -2]) / 3
    low, high = np.cos(np.radians(120)), np.cos(np.radians(20))
    assert stats.kstest(cosines, stats.uniform(low, high - low).cdf).pvalue > MIN_P
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1, atol=1e-8)


def test_attitudes_have_scipys_angles() -> None:
    q = sampled({"distribution": "attitudes"})
    angles = 2 * np.arccos(np.clip(q[:, 0], -1, 1))  # density (1 - cos) / pi of uniform rotations
    assert stats.kstest(angles, lambda a: (a - np.sin(a)) / np.pi).pvalue > MIN_P
    assert (q[:, 0] >= 0).all()


def test_choices_have_their_weights() -> None:
    found = sampled({"distribution": "choice", "values": [True, False], "weights": [1, 3]})
    assert stats.binomtest(int(found.sum()), N, 0.25).pvalue > MIN_P


@given(st.sets(st.sampled_from("abcdef")), st.sets(st.sampled_from(FRAMES[:50])))
def test_other_parameters_and_pictures_change_no_draw(others, frames) -> None:
    def sample(name):
        words = {"distribution": "uniform", "low": 0, "high": 1}
        return Sample(parameter=name, distribution=distribution_of(words), per_frame=True)

    alone = sample_all([sample("p")], seed=0, name="x", frames=FRAMES[:50]).per_frame["p"]
    order = sorted(frames)
    beside = sample_all([*(sample(name) for name in others), sample("p")], seed=0, name="x", frames=order)
    assert beside.per_frame["p"] == [alone[FRAMES.index(frame)] for frame in order]


def test_seed_augmentation_parameter_picture_and_try_all_count() -> None:
    words = {"distribution": "uniform", "low": 0, "high": 1}
    sample, other = (Sample(parameter=name, distribution=distribution_of(words)) for name in "pq")
    draws = [
        sample_one(sample, seed=0, name="a"),
        sample_one(sample, seed=1, name="a"),
        sample_one(sample, seed=0, name="b"),
        sample_one(other, seed=0, name="a"),
        sample_one(sample, seed=0, name="a", frame="img000001"),
        sample_one(sample, seed=0, name="a", again=1),
    ]
    assert len(set(draws)) == len(draws)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ({"distribution": "gauss"}, "no distribution 'gauss'"),
        ({"distribution": "uniform", "low": 1}, "lacks 'high'"),
        ({"distribution": "uniform", "low": 2, "high": 1}, "no number lies between"),
        ({"distribution": "log_uniform", "low": 0, "high": 1}, "no logarithm"),
        ({"distribution": "normal", "mean": 0, "sigma": 0}, "sigma"),
        ({"distribution": "normal", "mean": 0, "sigma": 1, "low": 3.1}, "fewer than 0.001 of all values about 0"),
        ({"distribution": "normal", "mean": 0, "sigma": 1, "low": 2, "high": 2}, "no number lies between"),
        ({"distribution": "choice", "values": []}, "nothing to choose"),
        ({"distribution": "choice", "values": [1, 2], "weights": [0, 0]}, "all 0"),
        ({"distribution": "directions", "least": 50, "most": 40}, "no direction"),
        ({"distribution": "fixed", "value": 1, "low": 0}, "has no 'low'"),
    ],
)
def test_what_is_no_distribution_is_said(words, sentence) -> None:
    with pytest.raises(InputError, match=sentence):
        distribution_of(words)
