"""Lit is where renders have light of the Sun alone; `check` finds what is not."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.labels.lit import SunState, faults
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.effort import Effort
from tests.cases.labelled import labels_of, picture_of, sun
from tests.cases.scenes import BARREL, box, boxes, pose, scene, target

OBLIQUE = sun((0.6, 0.36, np.sqrt(0.5104)))
TURNED = pose((0.9, -0.3, 0.2, 0.1), (0.1, 0.1, 3.5))
DARK = 1e-4  # W/m2/sr of a white surface in a Sun of 1 W/m2


@pytest.fixture(scope="module")
def labelled():
    """Two boxes before a plate, which shade it and each other."""
    made = scene(target(*boxes()), camera=BARREL, T_cam_body=TURNED, lights=[OBLIQUE])
    return made, labels_of(made)


def test_every_state_is_there(labelled) -> None:
    _, labels = labelled
    counts = np.bincount(labels["lit"].ravel(), minlength=5)
    assert (counts[[SunState.LIT, SunState.SHADOWED, SunState.TURNED_AWAY]] > 200).all()
    assert counts[SunState.NO_SUN] == 0


def test_lit_pixels_have_light_in_a_preview(labelled) -> None:
    """One ray through each pixel's centre."""
    made, labels = labelled
    light = RaycastRenderer().radiance(made, Effort(samples=1), seed=0)
    states = labels["lit"][light.region.slices]
    np.testing.assert_array_equal(light.rgb[..., 0] > DARK, states == SunState.LIT)


def test_lit_pixels_have_light_in_cycles(labelled, blender) -> None:
    """Where a pixel and its neighbours agree, for rays go all over a pixel's square."""
    made, labels = labelled
    light = blender.radiance(made, Effort(samples=4, bounces=0), seed=0)
    states = labels["lit"][light.region.slices]
    inner = states[1:-1, 1:-1]
    alike = inner > 0
    for rows in range(3):
        for columns in range(3):
            alike &= states[rows : rows + inner.shape[0], columns : columns + inner.shape[1]] == inner
    assert alike.sum() > 5000
    np.testing.assert_array_equal((light.rgb[1:-1, 1:-1, 0] > DARK)[alike], (inner == SunState.LIT)[alike])


def test_the_shadows_edge_is_where_the_ray_says() -> None:
    """A box 0.2 m above a plate, and a Sun at 45 degrees: its shadow is moved by 0.2 m."""
    points, faces = box((-0.2, -0.2, -0.3), (0.2, 0.2, -0.2))
    plate, more = box((-1, -1, 0), (1, 1, 0.1))
    both = target(np.concatenate([points, plate]), np.concatenate([faces, more + 8]))
    made = scene(both, camera=BARREL, T_cam_body=pose(t=(0, 0, 3)), lights=[sun((np.sqrt(0.5), 0, np.sqrt(0.5)))])
    labels = labels_of(made)
    x, y, z = np.moveaxis(labels["dense_pose"], -1, 0)
    shade = (z == 0) & (labels["depth"] > 0) & (np.abs(y) < 0.199)
    inside, outside = (x > 0.001) & (x < 0.499), (x < -0.001) | (x > 0.501)
    assert (labels["lit"][shade & inside & (x > 0.25)] == SunState.SHADOWED).all()
    assert (labels["lit"][shade & outside] == SunState.LIT).all()
    assert (shade & inside & (x > 0.25)).sum() > 200


@pytest.mark.parametrize(
    "light", [None, replace(OBLIQUE, obscuration=1.0), replace(OBLIQUE, lights=frozenset({7}))], ids=str
)
def test_where_no_sun_is_nothing_is_lit(labelled, light) -> None:
    made, labels = labelled
    states = labels_of(made.with_lights((light,) if light else ()))["lit"]
    np.testing.assert_array_equal(states, SunState.NO_SUN * (labels["depth"] > 0))


def test_a_sun_without_shadows_reaches_all_that_faces_it(labelled) -> None:
    made, labels = labelled
    states = labels_of(made.with_lights((replace(OBLIQUE, shadows=False),)))["lit"]
    wanted = np.where(labels["lit"] == SunState.SHADOWED, SunState.LIT, labels["lit"])
    np.testing.assert_array_equal(states, wanted)


def test_its_key_depends_on_where_the_sun_is_and_not_on_its_strength(labelled) -> None:
    made, _ = labelled

    def key(light):
        return PIXEL_LABELS["lit"].key(made.with_lights((light,)), "geometry", 0)

    assert key(OBLIQUE) == key(replace(OBLIQUE, irradiance=(9.0, 8.0, 7.0))) == key(replace(OBLIQUE, obscuration=0.5))
    others = [sun((0, 0, 1)), replace(OBLIQUE, shadows=False), replace(OBLIQUE, obscuration=1.0)]
    assert len({key(OBLIQUE), *map(key, others)}) == 4


def test_faults_are_found(labelled) -> None:
    made, labels = labelled
    assert list(faults(picture_of(made, labels))) == []
    wrong = np.where(labels["lit"] == SunState.TURNED_AWAY, SunState.LIT, labels["lit"])
    assert [fault.code for fault in faults(picture_of(made, labels, lit=wrong))] == ["lit"]
    assert [fault.code for fault in faults(picture_of(made, labels, lit=0 * wrong))] == ["support"]
