"""The region of interest holds every pixel that the body can cover."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from spin_usd.geometry.bounds import PADDING_PX, convex_hull_2d, outline_of, polygon_area, region_of_interest
from spin_usd.geometry.transform import Transform
from tests.cases.scenes import BARREL, FOLDING, PINCUSHION, SMALL, SPEEDPLUS, box, unit_quaternions

STRAIGHT = replace(SPEEDPLUS, distortion=(0.0,) * 5)
SLACK_PX = 1  # whole pixels, and the bow of edges between their samples
CORNERS, FACES = box((-0.6, -0.4, -0.3), (0.6, 0.5, 0.2))


def surface(count=24):
    """Points all over the box, its edges included."""
    i, j = np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count))
    a, b = i.ravel()[:, None, None], (j * (1 - i)).ravel()[:, None, None]
    corners = CORNERS[FACES]
    return (corners[:, 0] + a * (corners[:, 1] - corners[:, 0]) + b * (corners[:, 2] - corners[:, 0])).reshape(-1, 3)


SURFACE = surface()


def covered(camera, points):
    """Pixels (N, 2) of the frame that the points in front of the camera fall into."""
    uv = camera.project(points)
    return uv[((uv >= 0) & (uv < (camera.width, camera.height))).all(1)]  # NaN is never inside


@settings(max_examples=400)
@given(
    st.sampled_from([SPEEDPLUS, BARREL, PINCUSHION, FOLDING, SMALL]),
    unit_quaternions(),
    st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-2, 12)),
)
@example(FOLDING, np.array([1.0, 0, 0, 0]), (0.9, 0.7, 1.2))  # a corner of the frame, where the lens nearly folds
@example(PINCUSHION, np.array([1.0, 0, 0, 0]), (0.0, 0.0, 0.7))  # fills the frame
@example(BARREL, np.array([1.0, 0, 0, 0]), (0.0, 0.0, 0.1))  # around the camera
def test_holds_every_surface_point(camera, q, aside) -> None:
    """In front, partly out of the frame, around the camera, behind it; also through lenses that nearly fold."""
    x, y, z = aside
    pose = Transform.from_quaternion(to="cam", of="body", q=q, t=(x * abs(z) / 2, y * abs(z) / 2, z))
    region = region_of_interest(camera, pose.points(CORNERS))
    uv = covered(camera, pose.points(SURFACE))
    assert region & camera.frame == region or region.empty
    assert ((uv >= (region.x0, region.y0)) & (uv <= (region.x1, region.y1))).all()


@given(st.sampled_from([SPEEDPLUS, BARREL, PINCUSHION]), unit_quaternions(), st.floats(8, 1e7))
def test_is_no_larger_than_needed(camera, q, z) -> None:
    """Wholly inside the frame, the box ends at the padding around the outermost points."""
    pose = Transform.from_quaternion(to="cam", of="body", q=q, t=(0, 0, z))
    region = region_of_interest(camera, pose.points(CORNERS))
    uv = camera.project(pose.points(CORNERS))
    low, high = uv.min(0) - PADDING_PX - SLACK_PX - 1, uv.max(0) + PADDING_PX + SLACK_PX + 1
    assert region.x0 >= low[0]
    assert region.y0 >= low[1]
    assert region.x1 <= high[0]
    assert region.y1 <= high[1]


@given(st.sampled_from([STRAIGHT, BARREL, FOLDING]), unit_quaternions(), st.floats(-0.4, 0.4), st.floats(0, 0.1))
def test_holds_every_point_smeared_and_no_more(camera, q, aside, most) -> None:
    """Each corner by a blur of its own, in normalised coordinates."""
    points = Transform.from_quaternion(to="cam", of="body", q=q, t=(4 * aside, 3 * aside, 8)).points(CORNERS)
    blur = most * np.arange(1, 9) / 8
    region = region_of_interest(camera, points, blur_radius=blur)
    turn = np.arange(360) * np.pi / 180
    rim = np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
    uv = covered(camera, ((points / points[:, 2:])[:, None] + blur[:, None, None] * rim).reshape(-1, 3))
    assert ((uv >= (region.x0, region.y0)) & (uv <= (region.x1, region.y1))).all()
    if not camera.distorted and region.padded(1) & camera.frame == region.padded(1):  # a lens bends the circles
        assert np.abs(uv.min(0) - (region.x0, region.y0)).max() <= PADDING_PX + SLACK_PX + 1
        assert np.abs(uv.max(0) - (region.x1, region.y1)).max() <= PADDING_PX + SLACK_PX + 1


def test_an_unbounded_smear_is_seen_everywhere() -> None:
    assert (
        region_of_interest(SPEEDPLUS, CORNERS + np.array([0, 0, 5]), blur_radius=np.full(8, np.inf)) == SPEEDPLUS.frame
    )


@pytest.mark.parametrize("t", [(0, 0, -3), (40, 0, 5), (0, -40, 5), (3e6, 0, 1e6)])
def test_out_of_view_is_empty(t) -> None:
    assert region_of_interest(SPEEDPLUS, CORNERS + t).empty


@pytest.mark.parametrize("t", [(1000, 0, 0), (-3, 0, 0.4), (0, 50, 0), (0, -2, -0.4)])
def test_what_stands_beside_the_camera_is_out_of_view(t) -> None:
    """It crosses the camera's plane, and no pixel can show it."""
    assert region_of_interest(SPEEDPLUS, CORNERS + t).empty


def test_a_camera_inside_the_body_sees_it_everywhere() -> None:
    assert region_of_interest(SPEEDPLUS, CORNERS) == SPEEDPLUS.frame


@pytest.mark.parametrize("points", [CORNERS[:1], CORNERS[:2], np.repeat(CORNERS[:1], 5, axis=0)])
def test_flat_bodies_have_a_region(points) -> None:
    """A point, a line, the same point many times."""
    points = np.add(points, (0, 0, 5))
    region = region_of_interest(SPEEDPLUS, points)
    uv = SPEEDPLUS.project(points)
    assert not region.empty
    assert ((uv >= (region.x0, region.y0)) & (uv <= (region.x1, region.y1))).all()


@given(st.integers(0, 2**31), st.integers(3, 60))
def test_convex_hull_is_qhulls(seed, count) -> None:
    points = np.random.default_rng(seed).normal(size=(count, 2))
    expected = points[ConvexHull(points).vertices]  # counter-clockwise, too
    found = convex_hull_2d(points)
    start = int(np.argmin(np.abs(expected - found[0]).sum(1)))
    np.testing.assert_array_equal(found, np.roll(expected, -start, axis=0))


@given(seed=st.integers(0, 2**32 - 1), far=st.floats(0, 1e6))
def test_polygon_area_is_qhulls(seed, far) -> None:
    points = np.random.default_rng(seed).normal(size=(12, 2)) + far
    assert polygon_area(convex_hull_2d(points)) == pytest.approx(ConvexHull(points - far).volume, rel=1e-6)


@pytest.mark.parametrize("camera", [SPEEDPLUS, BARREL, PINCUSHION])
def test_the_outline_of_a_body_in_view_is_the_area_it_covers(camera) -> None:
    """A body's silhouette within the frame: as many pixel centres as its outline's area, but for those of its rim."""
    corners = box()[0] * 0.4 + np.array([0.1, 0.05, 4])
    outline = outline_of(camera, corners)
    assert outline is not None
    region = region_of_interest(camera, corners)
    xy = camera.centres(region).reshape(-1, 2)
    hull = ConvexHull(corners[:, :2] / corners[:, 2:])
    inside = (hull.equations[:, :2] @ xy.T + hull.equations[:, 2:] <= 0).all(0).sum()
    rim = np.linalg.norm(outline - np.roll(outline, 1, 0), axis=1).sum()
    assert polygon_area(outline) == pytest.approx(inside, abs=rim)
