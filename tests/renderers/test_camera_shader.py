"""The camera shader's numbers, without Blender: its lens inverse against OpenCV, and where its rays start."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from spin_usd.errors import SpinError
from spin_usd.geometry import lens
from spin_usd.renderers.camera_shader import View, lens_inverse

LENS_PX = 1e-4  # what the inverse may be off by, over the whole frame
LENS_TEXT = 1e-7  # of its constants, which are written for float32
LENSES = [
    (-0.22383016606510672, 0.5140979708910638, -0.0006649961199834, -0.00021404771667484, -0.1312424742940771),
    (-0.35, 0.15, 0.001, -0.002, -0.03),
    (0.1, -0.05, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.02, -0.03, 0.0),
    (0.0, 0.0, 0.0, 0.0, 0.0),
]


@pytest.mark.parametrize("distortion", LENSES)
def test_lens_inverse_undistorts_as_opencv_does(speedplus, distortion) -> None:
    camera = replace(
        speedplus, width=1920, height=1200, fx=2988.58, fy=2988.34, cx=951.3, cy=612.8, distortion=distortion
    )
    inverse = lens_inverse(camera)
    pixels = np.random.default_rng(1).uniform((0, 0), (1920, 1200), (2000, 2))
    distorted = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy) / inverse.unit
    xy = distorted * np.polynomial.polynomial.polyval((distorted**2).sum(1), inverse.start)[:, None]
    for _ in range(inverse.steps):
        error = lens.distort(xy, inverse.distortion) - distorted
        xy -= np.linalg.solve(lens.distortion_jacobian(xy, inverse.distortion), error[..., None])[..., 0]
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-15)
    wanted = cv2.undistortPoints(pixels[:, None], camera.matrix, np.array(distortion), criteria=stop)[:, 0]
    assert np.abs((xy * inverse.unit - wanted) * (camera.fx, camera.fy)).max() < LENS_PX


@pytest.mark.filterwarnings("ignore:overflow encountered in divide:RuntimeWarning")  # at a pixel on the axis, harmless
@pytest.mark.parametrize("distortion", LENSES)
def test_the_shaders_newton_step_is_that_of_the_lens(speedplus, distortion) -> None:
    """Its text, worked out in double precision, against `distort` and `distortion_jacobian`."""
    camera = replace(speedplus, distortion=distortion)
    text = View(camera=camera, centre=np.array([0, 0, 5.0]), radius=1.0).shader
    first, rest = re.findall(r"float xx = .*?;\n|float xy = .*? / det;(?=\n  \})", text, re.DOTALL)
    rng = np.random.default_rng(2)
    (x, y), (x0, y0) = rng.uniform(-0.3, 0.3, (2, 2, 500))
    numbers = {"x": x.copy(), "y": y.copy(), "x0": x0, "y0": y0}
    statements = re.sub(r"\bfloat (?=\w+ =)|(?<=,) (?=\w+ =)", "", first + rest).replace(",", "\n").replace(";", "\n")
    exec("\n".join(line.strip() for line in statements.splitlines()), numbers)
    xy, own = np.stack([x, y], -1), lens_inverse(camera).distortion
    error = lens.distort(xy, own) - np.stack([x0, y0], -1)
    wanted = xy - np.linalg.solve(lens.distortion_jacobian(xy, own), error[..., None])[..., 0]
    np.testing.assert_allclose(np.stack([numbers["x"], numbers["y"]], -1), wanted, rtol=0, atol=LENS_TEXT)


def test_speedplus_lens_needs_one_step(speedplus) -> None:
    assert lens_inverse(speedplus).steps == 1
    straight = lens_inverse(replace(speedplus, distortion=(0.0,) * 5))
    assert (straight.unit, straight.start, straight.steps) == (1.0, (1.0,), 0)


def test_lens_that_folds_within_the_frame_is_refused(speedplus) -> None:
    with pytest.raises(SpinError, match="distortion"):
        lens_inverse(replace(speedplus, distortion=(-8.0, 0, 0, 0, 0)))


@pytest.mark.parametrize(
    ("centre", "near"),
    [
        ((0, 0, 4), True),
        ((0, 0, 15.9), True),
        ((0, 0, 17), False),
        ((3, 2, 1e7), False),
        ((0, 0, -50), True),
        ((50, 0, 1), True),
    ],
)
def test_far_targets_start_their_own_rays(speedplus, centre, near) -> None:
    view = View(camera=speedplus, centre=np.array(centre, float), radius=1.0)
    assert view.near == near
    assert np.allclose(view.location(view.centre), (centre[0], -centre[1], -centre[2]) if near else 0)
    assert view.depth > view.radius


def test_plain_camera_only_where_it_is_exact(speedplus) -> None:
    straight = replace(speedplus, distortion=(0.0,) * 5)
    view = View(camera=straight, centre=np.array([0, 0, 4.0]), radius=1.0)
    assert view.plain
    assert not replace(view, camera=speedplus).plain
    assert not replace(view, centre=np.array([0, 0, 100.0])).plain
    assert not replace(view, camera=replace(straight, fx=10.0)).plain
