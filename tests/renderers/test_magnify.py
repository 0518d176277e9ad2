"""Targets of few pixels, or of less than one: their light falls with the square of the range, and where they are."""

import numpy as np
import pytest

from spin_usd.picture.make_picture import Stopwatch, render_in
from spin_usd.renderers.magnify import magnified
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.derived.magnification import SMALL_PX, magnification
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from tests.cases import scenes

SUN = DistantLight(path="/Sun", direction_cam=(0.0, 0.6, 0.8), irradiance=(1361.0,) * 3)
RANGES = (100.0, 1e3, 1e4, 1e5, 1e6)  # metres, of a box of 1 m, through the lens of SPEED+: 30 px to 0.003 px
OFF_AXIS = (0.11, -0.07)  # so that it lies between pixels, where the lens distorts
ENERGY = 0.01
PLACE_PX = 0.02
RAYCAST = RaycastRenderer()


def box_at(make_scene, away: float):
    points, faces = scenes.box()
    x, y = OFF_AXIS
    place = (x * away, y * away, away)
    return make_scene(points, faces, camera=scenes.SPEEDPLUS, q=(0.9, 0.3, 0.2, 0.1), t=place, lights=[SUN])


def render(renderer, scene: Scene, samples: int) -> Radiance:
    settings = RenderSettings(renderer="", effort=Effort(samples=samples), seed=0)
    return render_in(in_unit_light(scene), renderer, settings, Stopwatch())


def light_of(radiance: Radiance) -> float:
    return float(radiance.rgb.sum(dtype=np.float64))


def test_light_falls_with_the_square_of_the_range_over_four_decades(make_scene) -> None:
    totals = [light_of(render(RAYCAST, box_at(make_scene, away), 16)) * away**2 for away in RANGES]
    assert totals == pytest.approx([totals[0]] * len(RANGES), rel=ENERGY)


def test_blender_keeps_to_that_law(blender, make_scene) -> None:
    """Its rays go through the distorted lens in float32."""
    totals = [light_of(render(blender, box_at(make_scene, away), 16)) * away**2 for away in RANGES]
    by_rays = light_of(render(RAYCAST, box_at(make_scene, RANGES[0]), 64)) * RANGES[0] ** 2
    assert totals == pytest.approx([by_rays] * len(RANGES), rel=ENERGY)


def test_light_is_where_the_target_is(make_scene) -> None:
    for away in RANGES[1:]:
        scene = box_at(make_scene, away)
        radiance = render(RAYCAST, scene, 16)
        v, u = np.indices(radiance.region.shape) + 0.5
        weights = radiance.coverage.astype(np.float64)
        found = [
            np.average(u, weights=weights) + radiance.region.x0,
            np.average(v, weights=weights) + radiance.region.y0,
        ]
        middle = scene.camera.project(np.array([[OFF_AXIS[0], OFF_AXIS[1], 1.0]]))[0]
        # The middle of light within a pixel is its centre: a target of less than one is known to the pixel alone.
        within = max(0.5, float((scene.outline_box[1] - scene.outline_box[0]).max()))
        assert np.abs(np.array(found) - middle).max() < within + PLACE_PX


def test_a_large_target_is_rendered_as_it_is_and_a_small_one_by_whole_pixels(make_scene) -> None:
    scene = box_at(make_scene, 100.0)
    assert magnification(scene) == 1
    small = box_at(make_scene, 1e3)
    assert magnification(small) > 1
    fine = magnified(small, magnification(small))
    assert float((fine.outline_box[1] - fine.outline_box[0]).max()) > SMALL_PX
    xy = np.array([[OFF_AXIS[0] + 1e-4, OFF_AXIS[1] - 2e-4]])
    shift = fine.camera.pixels(xy) - small.camera.pixels(xy) * magnification(small)
    assert shift == pytest.approx(np.round(shift), abs=1e-6)  # whole fine pixels


def test_what_is_magnified_is_in_the_key(make_scene, monkeypatch) -> None:
    settings = RenderSettings(renderer="raycast", effort=Effort(samples=1), seed=0)
    before = KeyMaker(settings).keys(box_at(make_scene, 1e4))
    monkeypatch.setattr("spin_usd.scene.derived.content_keys.magnification", lambda scene: 1)
    after = KeyMaker(settings).keys(box_at(make_scene, 1e4))
    assert before.radiance != after.radiance
    assert before.geometry == after.geometry
