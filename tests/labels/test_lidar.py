"""The LiDAR's points: exact without noise, distributed as its model says with it, and judged by `check`."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from spin_usd.labels.lidar import POINT, faults, point_cloud
from spin_usd.labels.table import CLOUD_LABELS, PIXEL_LABELS
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.echoes import echoes
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.lidar import Lidar
from tests.cases.labelled import picture_of
from tests.cases.scenes import BARREL, SMALL, box, pose, scene, soup, target, with_first
from tests.scene.derived.test_echoes import mounted

FLOAT32 = 6e-8  # half a step of float32, relative
UNLIKELY = 1e-3  # the seed is fixed: a law that holds is not refused by chance
NOISY = {"noise_constant": 0.01, "noise_proportional": 0.002}


def rng():
    return np.random.Generator(np.random.SFC64(7))


def measured(lidar, made=None):
    """The scene of a wall of 12 m at 5 m, or of `made`, with the LiDAR, what that meets, and its points."""
    made = made or scene(target(*box((-6, -6, 1), (6, 6, 2))))
    made = replace(made, lidar=lidar)
    met = echoes(made, EmbreeCaster().first_faces)
    return made, met, point_cloud(made, met, rng())


def a_lidar(**fields):
    return Lidar(T_cam_lidar=mounted(), **{"rows": 100, "columns": 120, "azimuth_deg": (-40, 40), **fields})


def test_without_noise_points_lie_on_their_beams_and_on_the_surface() -> None:
    lidar = a_lidar()
    _, met, cloud = measured(lidar)
    assert cloud.dtype == POINT
    assert len(cloud) == len(met.beam) == lidar.beams
    np.testing.assert_array_equal(cloud["ranges"], cloud["exact_ranges"])
    np.testing.assert_array_equal(cloud["ranges"], met.range.astype(np.float32))
    np.testing.assert_allclose(cloud["points"][:, 0], 5, rtol=2 * FLOAT32)  # the wall is 5 m ahead


def test_errors_are_normal_with_the_models_deviation() -> None:
    lidar = a_lidar(**NOISY)
    _, met, cloud = measured(lidar)
    error = (cloud["ranges"].astype(float) - met.range) / (0.01 + 0.002 * met.range)
    assert len(error) == 12000
    assert stats.kstest(error, "norm").pvalue > UNLIKELY
    near, far = error[met.range < 5.5], error[met.range > 6]
    for some in (near, far):  # constant and proportional: the variance is right at each range
        sum_of_squares = (some**2).sum()
        assert UNLIKELY < stats.chi2.cdf(sum_of_squares, len(some)) < 1 - UNLIKELY


def test_as_many_returns_are_lost_as_the_model_says() -> None:
    lidar = a_lidar(drop_out=0.1)
    _, met, cloud = measured(lidar)
    assert stats.binomtest(len(met.beam) - len(cloud), len(met.beam), 0.1).pvalue > UNLIKELY


def test_a_beams_chance_does_not_depend_on_what_others_meet() -> None:
    lidar = a_lidar(drop_out=0.3, **NOISY)
    _, _, whole = measured(lidar)
    half = scene(target(*box((-6, -6, 1), (0, 6, 2))))
    _, _, some = measured(lidar, half)
    both, i, j = np.intersect1d(whole["beams"], some["beams"], return_indices=True)
    assert len(both) > 3000
    np.testing.assert_array_equal(whole["ranges"][i], some["ranges"][j])


def test_flat_angles_and_ranges_outside_the_limits_do_not_come_back() -> None:
    _, met, cloud = measured(a_lidar(max_incidence_deg=30, range_limits=(5.2, 5.5)))
    angle, inside = np.degrees(np.arccos(met.cosine)), (met.range >= 5.2) & (met.range <= 5.5)
    np.testing.assert_array_equal(cloud["beams"], met.beam[(angle <= 30) & inside])
    assert 0 < len(cloud) < len(met.beam)


@pytest.fixture(scope="module")
def pictured():
    """A soup of triangles under a strong lens, its labels, and the points of a LiDAR beside the camera."""
    points, faces, parts = soup(11, count=60)
    made = scene(target(points, faces, parts=parts), camera=BARREL, T_cam_body=pose((0.5, -0.3, 0.7, 0.2), (0, 0, 4)))
    lidar = replace(a_lidar(elevation_deg=(-30, 30), **NOISY), T_cam_lidar=mounted(position=(0.1, 0, 0)))
    made, _, cloud = measured(lidar, made)
    surface = visible_surface(made, EmbreeCaster().visibility(made))
    labels = {name: PIXEL_LABELS[name].make(made, surface) for name in ("depth", "segmentation")}
    return made, {**labels, "lidar": cloud}


def judged(made, labels, **changed):
    cloud = labels["lidar"].copy()
    for name, values in changed.items():
        cloud[name] = values(cloud[name])
    return [fault.code for fault in faults(picture_of(made, {**labels, "lidar": cloud}), "lidar")]


def test_points_that_are_right_have_no_fault(pictured) -> None:
    assert judged(*pictured) == []


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"points": lambda old: old + np.float32(1e-4)}, "beams"),
        ({"beams": lambda old: old[::-1]}, "beams"),
        ({"parts": lambda old: old + 1}, "parts"),
        ({"targets": lambda old: old + 1}, "parts"),
        ({"exact_ranges": lambda old: old + 0.5}, "noise"),
        ({"exact_ranges": lambda old: old * np.float32(1.01)}, "lidar"),
        ({"exact_ranges": lambda old: old * np.float32(0.99)}, "lidar"),
    ],
)
def test_points_that_are_off_are_found(pictured, changed, code) -> None:
    made, labels = pictured
    assert code in judged(made, labels, **changed)


def test_another_mounting_than_the_records_is_found(pictured) -> None:
    made, labels = pictured
    beside = replace(made.lidar, T_cam_lidar=mounted(position=(0.1, 0.05, 0)))
    assert judged(replace(made, lidar=beside), labels) == ["lidar"]


def test_points_of_an_unknown_lidar_are_found(pictured) -> None:
    made, labels = pictured
    assert judged(replace(made, lidar=None), labels) == ["lidar"]


def test_the_key_covers_what_decides_the_points_and_not_the_camera(pictured) -> None:
    made, _ = pictured

    def key(changed, seed=1):
        return CLOUD_LABELS["lidar"].key(changed, "geometry", seed)

    quiet = replace(made, lidar=replace(made.lidar, noise_constant=0.0, noise_proportional=0.0))
    assert key(made) == key(replace(made, camera=SMALL))
    others = [with_first(made, T_cam_body=pose(t=(0, 0, 5))), replace(made, lidar=replace(made.lidar, rows=99)), quiet]
    assert len({key(made), key(made, seed=2), *map(key, others)}) == 5
    assert key(quiet, seed=2) == key(quiet)  # where nothing is left to chance, its seed does not count
    assert key(replace(made, lidar=None)) == ""
