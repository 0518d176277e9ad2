"""Poses sampled one by one: where they put the target, and that all of it is in the picture where that is asked for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest, truncnorm, uniform

from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.sampling.distribution import Attitudes, Choice, Fixed, Normal, Uniform
from spin_usd.sampling.poses import PoseLaw, PositionLaw, in_frame
from spin_usd.sampling.stream import stream

CAMERA = Camera(width=1920, height=1200, fx=2988, fy=2989, cx=950, cy=610)
HULL = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0, 0.3)])
PLACE = PositionLaw(
    range=Uniform(low=2, high=10),
    across=Normal(mean=0, sigma=90, low=-200, high=200),
    down=Normal(mean=0, sigma=140, low=-540, high=540),
    frame=(CAMERA.width, CAMERA.height),
)
SURE = 1e-3  # of a test of the right distribution, the seed being what it is


def sampled(law, count=400, hull=HULL):
    found = [law.sample(stream(5, "pose", str(i)), CAMERA, hull) for i in range(count)]
    return tuple(np.array(each) for each in zip(*found, strict=True))


def test_range_and_offsets_are_as_their_laws_say() -> None:
    _, t = sampled(PoseLaw(place=PLACE, attitude=Attitudes()), count=2000)
    u, v = (CAMERA.project(t) - (CAMERA.cx, CAMERA.cy)).T
    assert kstest(np.linalg.norm(t, axis=1), uniform(2, 8).cdf).pvalue > SURE
    assert kstest(u, truncnorm(-200 / 90, 200 / 90, scale=90).cdf).pvalue > SURE
    assert kstest(v, truncnorm(-540 / 140, 540 / 140, scale=140).cdf).pvalue > SURE


def test_all_of_the_target_is_in_the_picture_where_that_is_asked_for() -> None:
    whole = PoseLaw(place=PLACE, attitude=Attitudes(), whole=True)
    for q, t in zip(*sampled(whole), strict=True):
        assert in_frame(CAMERA, HULL, q[None], t[None])
    anywhere = sampled(PoseLaw(place=PLACE, attitude=Attitudes()))
    assert not all(in_frame(CAMERA, HULL, q[None], t[None]) for q, t in zip(*anywhere, strict=True))


@pytest.mark.parametrize("smaller", [1, 3])
def test_a_smaller_frame_of_the_same_view_shows_the_same(smaller) -> None:
    """The principal point is no part of a place; all else of a third of the pixels is a third."""
    size = {name: getattr(CAMERA, name) / smaller for name in ("fx", "fy", "cx", "cy")}
    small = Camera(width=CAMERA.width // smaller, height=CAMERA.height // smaller, **size)
    for i in range(50):
        mine, theirs = (PLACE.sample(stream(5, str(i)), camera) for camera in (small, CAMERA))
        np.testing.assert_allclose(mine, theirs, rtol=1e-12)


def test_a_target_behind_the_camera_is_not_in_the_picture() -> None:
    assert not in_frame(CAMERA, HULL, np.array([[1.0, 0, 0, 0]]), np.array([[0.0, 0, -5]]))


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"attitude": Fixed(value=1.0)}, "is not a quaternion"),
        ({"attitude": Fixed(value=(0.0, 0.0, 0.0, 0.0))}, "is not a quaternion"),
        ({"place": replace(PLACE, range=Choice(values=("far",)))}, "is not a number"),
        ({"place": replace(PLACE, range=Fixed(value=0.3)), "whole": True}, "none of 10000"),
    ],
)
def test_what_is_no_pose_is_said(changes, word) -> None:
    law = PoseLaw(**{"place": PLACE, "attitude": Attitudes()} | changes)
    with pytest.raises(InputError, match=word):
        law.sample(stream(1, "a"), CAMERA, HULL)
