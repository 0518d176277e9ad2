"""Figures from renders of which it is known how they differ, made by raycast in this process."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.accuracy.error import FLOOR
from spin_usd.accuracy.measurement import Configuration
from spin_usd.commands.measure.figures import PictureFigures
from spin_usd.commands.measure.renders import RenderCost, RenderStore
from spin_usd.errors import InputError
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import AutoExposure, Sensor
from tests.cases import scenes

SUN = DistantLight(path="/Sun", direction_cam=(0.36, -0.48, 0.8), irradiance=(1361.0, 1200.0, 900.0))
SENSOR = Sensor(gain=2.0, read_noise=5.0, auto_exposure=AutoExposure())
SETTING = Configuration(renderer="raycast", effort=Effort(samples=4))
SEEDS, PARTS = 4, range(1000, 1004)
REFERENCE = [f"reference{seed}" for seed in PARTS]


@pytest.fixture(scope="module")
def scene():
    return scenes.scene(
        scenes.target(*scenes.box()), T_cam_body=scenes.pose((0.8, 0.3, -0.2, 0.4)), lights=[SUN], sensor=SENSOR
    )


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("measured")
    return RenderStore(root=folder / "runs", work=folder / "work")


def same(image):
    return image


def make(runs, scene, name, *, samples, seeds, change=same, cover=same, cpu_s=1.0, warm=True):
    """Renders whose light is changed by `change` and coverage by `cover`; their keys."""
    keys = []
    for seed in seeds:
        found = RaycastRenderer().radiance(in_unit_light(scene).scene, Effort(samples=samples), seed=seed)
        changed = Radiance(region=found.region, groups=change(found.groups), coverage=cover(found.coverage))
        cost = RenderCost(
            cpu_s=cpu_s + seed % 10, wall_s=cpu_s / 2, memory_bytes=100 + seed, warm=warm and seed != seeds[0]
        )
        runs.keep(f"{name}{seed}", changed, cost)
        keys.append(f"{name}{seed}")
    return keys


@pytest.fixture(scope="module")
def picture(runs, scene):
    return PictureFigures(scene, runs, make(runs, scene, "reference", samples=64, seeds=PARTS))


def counted(picture):
    """What a deviation in proportion to the light, squared, counts: less than itself where the light is near FLOOR."""
    light = picture.reference.radiance
    power = (light**2).mean(-1)
    return float((power / (power + (FLOOR * light.mean()) ** 2)).mean())


def test_more_samples_are_less_noisy_and_neither_is_biased(picture, runs, scene) -> None:
    few, many = (
        picture.linear_error(make(runs, scene, f"s{samples}_", samples=samples, seeds=range(SEEDS)))
        for samples in (4, 16)
    )
    assert many.variance < few.variance / 2
    assert abs(few.bias_squared) < few.variance / 2
    assert abs(few.brightness) < 0.02


def test_light_too_much_is_a_bias(picture, runs, scene) -> None:
    keys = make(runs, scene, "bright", samples=64, seeds=range(SEEDS), change=lambda light: np.float32(1.1) * light)
    found = picture.linear_error(keys)
    assert found.bias_squared == pytest.approx(0.01 * counted(picture), rel=0.01)
    assert found.brightness == pytest.approx(0.1, abs=0.002)


def test_the_image_is_exposed_as_the_reference_asks(picture, runs, scene) -> None:
    """So twice the light is twice as bright, whatever the metering would make of it; and half the light half."""
    image = picture.developed(seed=0)
    assert image.scene.sensor.auto_exposure is None
    off = []
    for factor in (0.5, 0.75, 1.0):
        keys = make(
            runs, scene, f"x{factor}_", samples=64, seeds=range(2), change=lambda x, f=factor: np.float32(f) * x
        )
        off.append(picture.figures(image, SETTING, keys).error_dn)
    assert off[0] > off[1] > 5 * off[2]


def test_the_detectors_noise_is_its_own(picture, scene, runs) -> None:
    """Without gain there is only rounding to whole numbers."""
    assert picture.developed(seed=0).noise > 1
    ideal = replace(scene, sensor=Sensor(auto_exposure=AutoExposure()))
    assert 0 < PictureFigures(ideal, runs, REFERENCE).developed(seed=0).noise <= 0.5


def test_a_reference_that_never_meets_the_target_has_no_image_of_it(runs, scene) -> None:
    """A target far smaller than a pixel: none of its figures would be a number."""
    nothing = make(runs, scene, "missed", samples=1, seeds=PARTS, change=np.zeros_like, cover=np.zeros_like)
    with pytest.raises(InputError, match=f"^{scene.frame.name}: no ray of the reference meets the target; "):
        PictureFigures(scene, runs, nothing).developed(seed=0)


def test_the_references_own_error_is_not_taken_for_the_settings(picture, runs, scene) -> None:
    """Compared with itself, or with renders as good as it, next to nothing is left after the detector."""
    keys = make(runs, scene, "good", samples=64, seeds=range(SEEDS))
    rough = make(runs, scene, "rough", samples=2, seeds=range(SEEDS))
    image = picture.developed(seed=0)
    good, bad = (picture.figures(image, SETTING, each) for each in (keys, rough))
    assert image.variance > 0
    assert good.error_dn < bad.error_dn / 3
    assert good.structure < bad.structure
    assert good.seeds == SEEDS


def test_no_error_below_a_capped_references_own_is_claimed(picture, runs, scene) -> None:
    """Of renders that are the reference's own parts, whose error is estimated at nearly none."""
    image, keys = picture.developed(seed=0), make(runs, scene, "own", samples=64, seeds=PARTS)
    capped, known = (picture.figures(image, SETTING, keys, capped=capped) for capped in (True, False))
    own = picture.reference.error_squared**0.5
    assert capped.error_at_most >= own
    assert capped.error_dn_at_most >= image.variance**0.5
    assert (capped.error, capped.error_dn) == (known.error, known.error_dn)
    assert capped.error_at_most > known.error_at_most > known.error
    assert capped.error_dn_at_most > known.error_dn_at_most > known.error_dn


def test_cost_is_the_median_of_what_was_not_the_first(picture, runs, scene) -> None:
    found = picture.figures(picture.developed(seed=0), SETTING, make(runs, scene, "c", samples=4, seeds=range(4)))
    assert (found.cpu_s, found.wall_s, found.memory_bytes) == (3.0, 0.5, 103)
    cold = make(runs, scene, "cold", samples=4, seeds=range(3), warm=False)
    assert picture.cost(cold)["cpu_s"] == 2.0


def test_differences_are_of_runs_pair_by_pair(picture, runs, scene) -> None:
    keys = make(runs, scene, "a", samples=64, seeds=range(2))
    dimmer = make(runs, scene, "b", samples=64, seeds=range(2), change=lambda light: np.float32(0.9) * light)
    assert picture.difference(keys, keys) == 0
    assert picture.difference(keys, dimmer) == pytest.approx(0.1 * counted(picture) ** 0.5, rel=0.01)


def test_a_saving_is_of_pairs_that_took_turns(picture, runs, scene) -> None:
    """So a machine that is slower for a while slows down both."""
    without = make(runs, scene, "plain", samples=4, seeds=range(3), cpu_s=2.0)
    twice, unsure = ([f"{name}{seed}" for seed in range(3)] for name in ("twice", "unsure"))
    for keys, factors in ((twice, (2, 2, 2)), (unsure, (1.1, 1, 0.9))):
        for key, plain, factor in zip(keys, without, factors, strict=True):
            cost = runs.cost(plain)
            runs.keep(key, runs.render(plain, scene.picture_region, groups=1), replace(cost, cpu_s=factor * cost.cpu_s))
    sure, unsure_one = (picture.saving("work", keys, without) for keys in (twice, unsure))
    assert (sure.ratio_least, sure.ratio_most) == (2, 2)
    assert (unsure_one.ratio_least, unsure_one.ratio_most) == pytest.approx((0.9, 1.1))
    assert sure.difference == 0 < sure.noise


def test_the_targets_pixels_are_those_that_it_covers_by_half(picture) -> None:
    frame = picture.measured(picture.developed(seed=0), samples=4, capped=False)
    coverage = np.mean([picture.radiance(key).coverage for key in REFERENCE], 0)
    assert frame.target_pixels == int((coverage >= 0.5 * coverage.max()).sum()) < int((coverage > 0).sum())
    assert frame.reference_error**2 == pytest.approx(picture.reference.error_squared)


def test_a_run_that_was_damaged_is_not_there(runs, scene) -> None:
    (key,) = make(runs, scene, "d", samples=1, seeds=range(1))
    assert runs.has(key)
    path = runs.root / key[:2] / f"{key}.exr"
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    assert not runs.has(key)


def test_what_is_not_used_is_removed(tmp_path, scene) -> None:
    """And nothing that is no run."""
    runs = RenderStore(root=tmp_path / "runs", work=tmp_path / "work")
    one, other = make(runs, scene, "a" * 63, samples=1, seeds=range(2))
    result = "b" * 64
    runs.write_result(result, {"a": 1})
    notes = tmp_path / "runs" / "bb" / "notes.json"
    notes.write_text("mine")
    runs.remove_all(but=[one])
    assert runs.has(one)
    assert not runs.has(other)
    assert runs.known(result) is None
    assert notes.read_text() == "mine"
