"""What is refused does not depend on the seed, and what is left is within the parameter's limits."""

from functools import partial

import numpy as np
import pytest
from scipy import stats

from spin_usd.errors import InputError
from spin_usd.sampling.sample import sample_all
from spin_usd.specifications.sample_pictures import SampledPictures, sample_pictures, samples_for
from spin_usd.specifications.sample_table import samples_of
from spin_usd.stage.augment.sampled_values import open_base
from spin_usd.stage.composition.open_stage import open_stage

FRAMES = [f"img{i:06d}" for i in range(2000)]
MIN_P = 1e-3  # seeds are fixed: a test that passes once passes always


def entries(name, **words):
    return samples_of({name: words})


@pytest.mark.parametrize(
    ("name", "words", "sentence"),
    [
        ("optics.glare", {"distribution": "fixed", "value": 2}, "could be 2; choose numbers from 0 to 1"),
        ("optics.glare", {"distribution": "uniform", "low": 0, "high": 1.0001}, "choose numbers from 0 to 1"),
        (
            "exposure.time",
            {"distribution": "log_uniform", "low": 1e-8, "high": 1, "unit": "ms"},
            "could be 1e-11 to 0.001 s; choose numbers from 1e-09 to 1e",
        ),
        ("optics.glare", {"distribution": "choice", "values": [0.1, 0.2, -0.1]}, "could be -0.1; choose"),
        ("optics.glare", {"distribution": "normal", "mean": 0.5, "sigma": 1, "high": 1.5}, "could be 1.5"),
        ("optics.glare", {"distribution": "normal", "mean": 9, "sigma": 1}, "fewer than 0.001 of all values about 9"),
        ("focus.fstop", {"distribution": "uniform", "low": 0, "high": 8}, "could be 0 to 8; choose numbers"),
        ("focus.distance", {"distribution": "uniform", "low": 0, "high": 8, "unit": "m"}, "choose numbers above 0"),
        ("earth.visible", {"distribution": "uniform", "low": 0, "high": 1}, "does not take 0.0: it is a truth"),
        ("sun.factor", {"distribution": "uniform", "low": -0.001, "high": 2}, "choose numbers from 0 to"),
        ("/World/Camera.exposure:time", {"distribution": "fixed", "value": 0}, "choose numbers from 1e-09 to 1e"),
        ("material.*.ior", {"distribution": "uniform", "low": 0.99, "high": 2}, "choose numbers from 1 to 1000"),
        ("/World/Camera.spin:optics:glare", {"distribution": "uniform", "low": 0, "high": 1.1}, "numbers from 0 to 1"),
    ],
)
def test_a_range_outside_of_the_limits_is_refused_before_any_draw(name, words, sentence) -> None:
    with pytest.raises(InputError, match=sentence) as caught:
        samples_for(entries(name, **words))
    assert caught.value.where == name


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("focus.fstop", {"distribution": "fixed", "value": 0}),
        ("focus.fstop", {"distribution": "choice", "values": [0, 8]}),
        ("optics.glare", {"distribution": "uniform", "low": 0, "high": 1}),
        ("exposure.time", {"distribution": "log_uniform", "low": 1, "high": 100, "unit": "ms"}),
    ],
)
def test_a_range_up_to_the_limits_is_not(name, words) -> None:
    assert samples_for(entries(name, **words))


def test_a_normal_distribution_is_cut_at_the_limits() -> None:
    (sample,) = samples_for(entries("optics.glare", distribution="normal", mean=0.5, sigma=1, high=0.9, per="frame"))
    values = np.array(sample_all([sample], seed=0, name="a", frames=FRAMES).per_frame["optics.glare"])
    assert stats.kstest(values, stats.truncnorm(-0.5, 0.4, 0.5, 1).cdf).pvalue > MIN_P


def test_a_normal_distribution_is_cut_above_an_open_limit() -> None:
    (sample,) = samples_for(entries("focus.distance", distribution="normal", mean=0, sigma=1, unit="m", per="frame"))
    sampled = sample_all([sample], seed=0, name="a", frames=FRAMES).per_frame["focus.distance"]
    assert np.min(np.array(sampled, float)) > 0


STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    metersPerUnit = 1
)
def Xform "World"
{
    def Camera "Camera"
    {
    }
    def Xform "Target" (
        prepend apiSchemas = ["SpinTargetAPI"]
    )
    {
        def Material "Paint"
        {
            token outputs:surface.connect = </World/Target/Paint/Surface.outputs:surface>
            def Shader "Surface"
            {
                uniform token info:id = "UsdPreviewSurface"
                float inputs:roughness = 0.5
                color3f inputs:diffuseColor = (0.2, 0.4, 0.8)
                float inputs:ior = 1.5
                token outputs:surface
            }
        }
    }
}
"""


@pytest.fixture(scope="module")
def painted(tmp_path_factory):
    path = tmp_path_factory.mktemp("painted") / "stage.usda"
    path.write_text(STAGE)
    base, frames, _ = open_base(open_stage(path))
    return partial(sample_pictures, base, SampledPictures(names=frames))


@pytest.mark.parametrize(
    ("of", "words", "sentence"),
    [
        (
            "roughness",
            {"distribution": "uniform", "low": 0.5, "high": 2.01},
            r"2\.01, which turns .* into 1\.005",
        ),
        ("ior", {"distribution": "uniform", "low": 0.6, "high": 1}, r"0\.6, which turns an input into 0\.9"),
        ("diffuseColor", {"distribution": "choice", "values": [1, [4, 2, 1.3]]}, r"which turns an input into 1\.04"),
        ("roughness", {"distribution": "normal", "mean": 3, "sigma": 0.1}, "fewer than 0.001 of all values about 3"),
    ],
)
def test_a_factor_that_no_material_can_have_is_refused_whatever_the_seed(painted, of, words, sentence) -> None:
    name = f"material.Paint.{of}.factor"
    for seed in range(3):
        with pytest.raises(InputError, match=sentence) as caught:
            painted(entries(name, **words), seed=seed, name="a")
        assert caught.value.where == name


def test_a_factor_is_cut_where_the_brightest_colour_is_white(painted) -> None:
    words = {"distribution": "normal", "mean": 1.25, "sigma": 0.1}
    made = [
        painted(entries("material.Paint.diffuseColor.factor", **words), seed=seed, name="a").attributes[0]
        for seed in range(20)
    ]
    assert all(0.8 < max(opinion.value) <= 1 for opinion in made)


def test_colours_are_multiplied_one_by_one(painted) -> None:
    words = {"distribution": "fixed", "value": [5, 2.5, 1.25]}
    (made,) = painted(entries("material.Paint.diffuseColor.factor", **words), seed=0, name="a").attributes
    np.testing.assert_allclose(made.value, (1, 1, 1), rtol=1e-6)
