"""Where a body lies to the frame, against the projections of points all over it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.geometry.framing import Framing, framings
from tests.cases import scenes

BODY = np.array([[x, y, z] for x in (-0.3, 0.5) for y in (-0.2, 0.2) for z in (-0.1, 0.4)])
EDGE_PX = 0.2  # between two of the points that are tried, a body may reach so much further into the picture


def everywhere():
    """(N, 3) all over the body, close together."""
    x, y, z = (np.linspace(BODY[:, i].min(), BODY[:, i].max(), 25) for i in range(3))
    return np.stack(np.meshgrid(x, y, z), -1).reshape(-1, 3)


def poses(count, seed=0):
    """In front, beside, behind, around, near and far, at random."""
    rng = np.random.default_rng(seed)
    rotations = Rotation.random(count, random_state=rng).as_matrix()
    places = rng.normal(size=(count, 3)) * rng.choice([0.4, 1.5, 4.0], (count, 1))
    return rotations, places


def by_projection(camera, rotation, place):
    """The framing that points all over the body tell; None where they are too near to an edge to tell."""
    points = everywhere() @ rotation.T + place
    eye = -rotation.T @ place
    if ((eye > BODY.min(0)) & (eye < BODY.max(0))).all():
        return Framing.CAMERA_INSIDE
    if (points[:, 2] <= 0).all():
        return Framing.BEHIND
    with np.errstate(invalid="ignore"):
        uv = camera.project(points)
    inside = ((uv >= 0) & (uv <= (camera.width, camera.height))).all(1)
    seen = uv[np.isfinite(uv).all(1)]
    nearest = np.abs(np.minimum(seen, (camera.width, camera.height) - seen)).min(initial=np.inf)
    if nearest < EDGE_PX and (inside.all() or not inside.any()):
        return None
    return Framing.WHOLE if inside.all() else Framing.CUT_OFF if inside.any() else Framing.OUTSIDE


@pytest.mark.parametrize("camera", [scenes.SMALL, scenes.BARREL, scenes.PINCUSHION], ids=["small", "barrel", "pincushion"])  # fmt: skip  # noqa: E501
def test_framings_are_those_of_points_all_over_the_body(camera) -> None:
    rotations, places = poses(500)
    found = framings(camera, BODY, rotations, places)
    told = [by_projection(camera, r, t) for r, t in zip(rotations, places, strict=True)]
    sure = [i for i, framing in enumerate(told) if framing is not None]
    assert len(sure) > 350
    assert set(found[sure]) == set(Framing)
    assert [Framing(found[i]) for i in sure] == [told[i] for i in sure]


def test_a_plate_larger_than_the_frame_is_cut_off_though_no_corner_of_it_is_seen() -> None:
    plate = np.array([[x, y, 0.0] for x in (-9, 9) for y in (-9, 9)])
    found = framings(scenes.SMALL, plate, np.eye(3)[None], np.array([[0, 0, 4.0]]))
    assert found.tolist() == [Framing.CUT_OFF]


def test_a_body_beside_the_camera_reaches_behind_it_and_is_outside() -> None:
    found = framings(scenes.SMALL, BODY, np.eye(3)[None].repeat(2, 0), np.array([[8, 0, 0.0], [0.6, 0, 0.1]]))
    assert found.tolist() == [Framing.OUTSIDE, Framing.OUTSIDE]


def test_the_principal_point_may_lie_outside_the_frame() -> None:
    camera = replace(scenes.SMALL, cx=200.0, distortion=(0.0,) * 5)
    left = (30 - 200) / camera.fx * 4
    found = framings(camera, BODY / 10, np.eye(3)[None].repeat(2, 0), np.array([[0, 0, 4.0], [left, 0, 4.0]]))
    assert found.tolist() == [Framing.OUTSIDE, Framing.WHOLE]
