"""A planet in a frame: what is not seen is not worked on, and what is does not depend on that."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.renderers.background import planet_view as view
from spin_usd.renderers.background.sky import sky
from spin_usd.scene.environment import Planet
from tests.cases import earths

FEW_WAVES = 0.1  # relative: the mean of a dozen of the longest waves of ground that varies by 0.18
CURVED = view.WIDE**2 / 8  # relative: by so much a cosine is off that is interpolated over so many radians
FLOAT32 = 1e-5  # relative: some tens of its roundings


def test_what_the_target_hides_changes_nothing_beside_it() -> None:
    scene = earths.low()
    hidden = np.zeros(scene.camera.frame.shape, bool)
    hidden[120:, 100:330] = True
    whole, around = sky(scene, seed=0), sky(scene, seed=0, hidden=hidden)
    assert whole is not None
    assert around is not None
    np.testing.assert_array_equal(whole[~hidden], around[~hidden])


def test_a_frame_that_the_target_fills_costs_no_planet() -> None:
    scene = earths.low()
    assert sky(scene, seed=0, hidden=np.ones(scene.camera.frame.shape, bool)) is None


def test_nodes_are_as_good_as_every_pixel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a planet without maps, whose light is smooth, between nodes and at each pixel."""
    scene = earths.seen_from((0.0, 0.0, 7.2e6), albedo=(0.3, 0.3, 0.3), clouds=None)
    nodes = sky(scene, seed=0)
    monkeypatch.setattr(view, "WIDE", 0.0)
    pixels = sky(scene, seed=0)
    assert nodes is not None
    assert pixels is not None
    assert (nodes != pixels).any()
    np.testing.assert_allclose(nodes, pixels, rtol=CURVED)


def test_lights_are_seen_by_night_past_clouds() -> None:
    scene = earths.seen_from((0.0, 0.0, 4.2e7), albedo=(0.0,) * 3, clouds=None, haze=(0.0,) * 3)
    night = earths.image((1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    dark = replace(scene, lights=())

    def middle(**fields: object) -> float:
        (planet,) = dark.environment.planets
        lit: Planet = replace(planet, night=night, night_radiance=(2e-3, 1e-3, 0.0), **fields)  # type: ignore[arg-type]
        frame = sky(replace(dark, environment=replace(dark.environment, planets=(lit,))), seed=0)
        assert frame is not None
        np.testing.assert_allclose(frame[120, 192, 1] * 2, frame[120, 192, 0], rtol=FLOAT32)
        return float(frame[110:130, 180:200, 0].mean())

    assert middle() == pytest.approx(2e-3, rel=FLOAT32)
    for opacity in (0.3, 0.8):
        clouds = earths.image((0.7, 0.7, 0.7, opacity), (0.7, 0.7, 0.7, opacity))
        assert middle(clouds=clouds) == pytest.approx((1 - opacity) * 2e-3, rel=FLOAT32)


def test_ground_without_clouds_is_as_bright_as_its_map_says() -> None:
    """Beside a planet of the same albedo without a map; its detail is as often brighter as darker."""
    grey = (0.3, 0.3, 0.3)
    maps = earths.image(grey, grey), grey
    mapped, plain = (sky(earths.seen_from((0.0, 0.0, 7.2e6), albedo=albedo, clouds=None), seed=0) for albedo in maps)
    assert mapped is not None
    assert plain is not None
    assert mapped.std() > 1.001 * plain.std()
    np.testing.assert_allclose(mapped.mean(), plain.mean(), rtol=FEW_WAVES)
