"""Bands of rows hold every pixel that a mesh can touch, once, and no more than the region of interest."""

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from spin_usd.geometry.bands import tight_bands
from spin_usd.geometry.bounds import region_of_interest
from spin_usd.geometry.region import Region
from spin_usd.geometry.transform import Transform
from tests.cases.scenes import BARREL, FOLDING, PINCUSHION, SMALL, SPEEDPLUS, box, unit_quaternions

CORNERS, FACES = box((-0.6, -0.4, -0.3), (0.6, 0.5, 0.2))
EDGES = np.unique(np.sort(np.concatenate([FACES[:, [0, 1]], FACES[:, [1, 2]], FACES[:, [2, 0]]]), axis=1), axis=0)


def surface(corners, count=40):
    """Points all over the triangles (F, 3, 3), their edges included."""
    i, j = np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count))
    a, b = i.ravel()[:, None, None], (j * (1 - i)).ravel()[:, None, None]
    return (corners[:, 0] + a * (corners[:, 1] - corners[:, 0]) + b * (corners[:, 2] - corners[:, 0])).reshape(-1, 3)


def bands_of(camera, points, cost=100.0):
    region = region_of_interest(camera, points)
    return region, tight_bands(camera, points, EDGES, region, band_cost_px=cost)


@settings(max_examples=300)
@given(
    st.sampled_from([SPEEDPLUS, BARREL, PINCUSHION, FOLDING, SMALL]),
    unit_quaternions(),
    st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-2, 12)),
    st.sampled_from([0.0, 100.0, 1e9]),
)
@example(SMALL, np.array([1.0, 0, 0, 0]), (0.0, 0.0, 0.35), 0.0)  # faces wider than the frame
def test_every_surface_point_lies_in_just_one_band(camera, q, t, cost) -> None:
    T_cam_body = Transform.from_quaternion(to="cam", of="body", q=q, t=t)
    region, bands = bands_of(camera, T_cam_body.points(CORNERS), cost)
    times = np.zeros((camera.height, camera.width), int)
    for band in bands:
        assert band & region == band
        times[band.slices] += 1
    assert times.max() <= 1
    uv = camera.project(T_cam_body.points(surface(CORNERS[FACES])))
    uv = uv[((uv >= 0) & (uv < (camera.width, camera.height))).all(1)].astype(int)
    assert (times[uv[:, 1], uv[:, 0]] == 1).all()


@settings(max_examples=100)
@given(st.sampled_from([SPEEDPLUS, BARREL, SMALL]), unit_quaternions(), st.floats(0, 40), st.floats(0, 2 * np.pi))
def test_every_smeared_point_lies_in_a_band(camera, q, smear, turn) -> None:
    points = Transform.from_quaternion(to="cam", of="body", q=q, t=(0.3, 0, 5)).points(CORNERS)
    region = region_of_interest(camera, points, blur_radius=np.full(8, smear / 50))
    bands = tight_bands(camera, points, EDGES, region, band_cost_px=50.0, blur_px=smear)
    inside = np.zeros((camera.height, camera.width), bool)
    for band in bands:
        inside[band.slices] = True
    pose = Transform.from_quaternion(to="cam", of="body", q=q, t=(0.3, 0, 5))
    uv = camera.project(pose.points(surface(CORNERS[FACES]))) + smear * np.array([np.cos(turn), np.sin(turn)])
    uv = uv[((uv >= (region.x0, region.y0)) & (uv < (region.x1, region.y1))).all(1)].astype(int)
    assert inside[uv[:, 1], uv[:, 0]].all()


def test_bands_of_a_slanted_box_leave_out_what_is_empty() -> None:
    q = np.array([np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)])  # 45 degrees about the optical axis
    points = Transform.from_quaternion(to="cam", of="body", q=q, t=(0, 0, 5)).points(CORNERS)
    region, bands = bands_of(SPEEDPLUS, points)
    # The slanted 1.2 x 0.9 rectangle covers half of its box.
    assert sum(band.width * band.height for band in bands) < 0.6 * region.width * region.height


def test_a_band_that_costs_more_than_it_saves_is_not_cut() -> None:
    points = Transform.from_quaternion(to="cam", of="body", q=(1, 0, 0, 0), t=(0, 0, 5)).points(CORNERS)
    _, bands = bands_of(SPEEDPLUS, points, cost=1e9)
    assert len(bands) == 1


def test_a_region_smaller_than_what_a_band_costs_stays_whole() -> None:
    q = np.array([np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)])
    points = Transform.from_quaternion(to="cam", of="body", q=q, t=(0, 0, 5)).points(CORNERS)
    region = region_of_interest(SPEEDPLUS, points)
    area = region.width * region.height
    assert bands_of(SPEEDPLUS, points, cost=area) == (region, [region])
    assert len(bands_of(SPEEDPLUS, points, cost=area / 20)[1]) > 1


def test_an_empty_region_has_no_bands() -> None:
    nothing = Region(x0=0, y0=0, x1=0, y1=0)
    assert tight_bands(SMALL, CORNERS + np.array([0, 0, 5]), EDGES, nothing, band_cost_px=1.0) == []
