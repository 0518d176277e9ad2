"""Poses sampled one by one: where they put the target, and that all of it is in the picture where that is asked for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.stats import kstest, truncnorm, uniform

from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.framing import framed_shares
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.sampling.attitudes import Attitudes
from spin_usd.sampling.distribution import Choice, Fixed, Normal, Uniform
from spin_usd.sampling.poses import Balls, BesideLaw, Inside, OffsetLaw, PoseLaw, PositionLaw, ShareLaw
from spin_usd.sampling.sample import stream

CAMERA = Camera(width=1920, height=1200, fx=2988, fy=2989, cx=950, cy=610)
HULL = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0, 0.3)])
OFFSETS = OffsetLaw(
    across=Normal(mean=0, sigma=90, low=-200, high=200),
    down=Normal(mean=0, sigma=140, low=-540, high=540),
    frame=(CAMERA.width, CAMERA.height),
)
PLACE = PositionLaw(range=Uniform(low=3, high=10), place=OFFSETS)
LENS = replace(CAMERA, distortion=(-0.22, 0.5, -7e-4, -2e-4, -0.13))
ANYWHERE = PositionLaw(
    range=Uniform(low=4, high=10), place=ShareLaw(u=Uniform(low=0, high=1), v=Uniform(low=0, high=1))
)
ALL = Inside(least=1.0)
GRID = 0.01  # what 200 x 200 points miss of an area
SURE = 1e-3  # of a test of the right distribution, the seed being what it is


def sampled(law, count=400, camera=CAMERA):
    found = [law.sample(stream(5, "pose", str(i)), camera, HULL) for i in range(count)]
    return tuple(np.array(each) for each in zip(*found, strict=True))


def test_range_and_offsets_are_as_their_laws_say() -> None:
    _, t = sampled(PoseLaw(position=PLACE, attitude=Attitudes()), count=2000)
    u, v = (CAMERA.project(t) - (CAMERA.cx, CAMERA.cy)).T
    assert kstest(np.linalg.norm(t, axis=1), uniform(3, 7).cdf).pvalue > SURE
    assert kstest(u, truncnorm(-200 / 90, 200 / 90, scale=90).cdf).pvalue > SURE
    assert kstest(v, truncnorm(-540 / 140, 540 / 140, scale=140).cdf).pvalue > SURE


def whole(q, t):
    """Whether all corners of the hull are in the frame."""
    uv = CAMERA.project(HULL @ matrix_from_quaternion(q).T + t)
    return bool(((uv >= 0) & (uv <= (CAMERA.width, CAMERA.height))).all())  # NaN is not


def test_all_of_the_target_is_in_the_picture_where_that_is_asked_for() -> None:
    everywhere = PoseLaw(position=PLACE, attitude=Attitudes())
    assert all(whole(*pose) for pose in zip(*sampled(replace(everywhere, inside=ALL), 100), strict=True))
    assert not all(whole(*pose) for pose in zip(*sampled(everywhere), strict=True))


def share(camera, rotation, translation):
    return next(framed_shares(camera, HULL, rotation[None], translation[None]))


def area_inside(q, t):
    """The share of the hull's outline within the frame, by counting points of an even grid without distortion."""
    p = HULL @ matrix_from_quaternion(q).T + t
    outline = ConvexHull(p[:, :2] / p[:, 2:])
    low, high = outline.min_bound, outline.max_bound
    x, y = np.meshgrid(*(np.linspace(low[i], high[i], 200) for i in (0, 1)))
    grid = np.stack([x.ravel(), y.ravel()], -1)
    grid = grid[(grid @ outline.equations[:, :2].T + outline.equations[:, 2] <= 0).all(1)]
    uv = LENS.pixels(grid)
    return float(((uv >= 0) & (uv <= (LENS.width, LENS.height))).all(1).mean())


def test_as_much_is_inside_as_is_asked_for_under_the_lens() -> None:
    law = PoseLaw(position=ANYWHERE, attitude=Attitudes(), inside=Inside(least=0.3, most=0.6))
    for q, t in zip(*sampled(law, 40, camera=LENS), strict=True):
        assert 0.3 - GRID <= area_inside(q, t) <= 0.6 + GRID
        assert share(LENS, matrix_from_quaternion(q), t) == pytest.approx(area_inside(q, t), abs=GRID)


def test_range_and_attitude_keep_their_laws_where_the_place_is_sampled_again() -> None:
    """Though of the places of a near target most are refused."""
    law = PoseLaw(position=ANYWHERE, attitude=Attitudes(), inside=ALL)
    q, t = sampled(law, 800, camera=LENS)
    assert kstest(np.linalg.norm(t, axis=1), uniform(4, 6).cdf).pvalue > SURE
    for component in np.abs(q).T:  # the law of |a component| of a uniform unit quaternion
        assert kstest(component, lambda x: 2 / np.pi * (np.arcsin(x) + x * np.sqrt(1 - x * x))).pvalue > SURE


def test_places_are_shares_of_the_frame_as_the_lens_shows_it() -> None:
    _, t = sampled(PoseLaw(position=ANYWHERE, attitude=Attitudes()), 1500, camera=LENS)
    for share in (LENS.project(t) / (LENS.width, LENS.height)).T:
        assert kstest(share, uniform(0, 1).cdf).pvalue > SURE


@pytest.mark.parametrize("smaller", [1, 3])
def test_a_smaller_frame_of_the_same_view_shows_the_same(smaller) -> None:
    """The principal point is no part of a place; all else of a third of the pixels is a third."""
    size = {name: getattr(CAMERA, name) / smaller for name in ("fx", "fy", "cx", "cy")}
    small = Camera(width=CAMERA.width // smaller, height=CAMERA.height // smaller, **size)
    for i in range(50):
        mine, theirs = (PLACE.sample(stream(5, str(i)), camera) for camera in (small, CAMERA))
        np.testing.assert_allclose(mine, theirs, rtol=1e-12)


def test_nothing_of_a_target_behind_the_camera_is_inside() -> None:
    assert share(CAMERA, np.eye(3), np.array([0, 0, -5.0])) == 0


def test_nothing_of_a_target_around_the_camera_is_inside() -> None:
    assert share(CAMERA, np.eye(3), np.array([0, 0, -0.1])) == 0


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"attitude": Fixed(value=1.0)}, "is not a quaternion"),
        ({"attitude": Fixed(value=(0.0, 0.0, 0.0, 0.0))}, "is not a quaternion"),
        ({"position": replace(PLACE, range=Choice(values=("far",)))}, "is not a number"),
        ({"position": replace(PLACE, range=Fixed(value=0.3)), "inside": ALL}, "none of 10230"),
    ],
)
def test_what_is_no_pose_is_said(changes, word) -> None:
    law = PoseLaw(**{"position": PLACE, "attitude": Attitudes()} | changes)
    with pytest.raises(InputError, match=word):
        law.sample(stream(1, "a"), CAMERA, HULL)


def test_beside_another_every_direction_is_alike_but_where_something_is() -> None:
    other, away = (1.0, 2.0, 30.0), Uniform(low=3, high=5)
    law = PoseLaw(position=BesideLaw(range=away, other=other), attitude=Attitudes())
    _, t = sampled(law, count=1000)
    towards = (t - other) / np.linalg.norm(t - other, axis=1, keepdims=True)
    for axis in range(3):  # of a sphere each coordinate is uniform (Archimedes)
        assert kstest(towards[:, axis], uniform(-1, 2).cdf).pvalue > SURE
    wall = Balls(middles=np.array([[10.0, 2, 30]]), radii=np.array([9.0]))  # all of one side of it
    apart = np.array([law.sample(stream(5, "pose", str(i)), CAMERA, HULL, wall)[1] for i in range(400)])
    assert np.linalg.norm(apart - wall.middles, axis=1).min() > 9.5  # a body that is half a metre wide, and more
    assert kstest(np.linalg.norm(apart - other, axis=1), uniform(3, 2).cdf).pvalue > SURE
