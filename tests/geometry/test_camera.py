"""The camera, against OpenCV and against the published SPEED+ labels."""

import dataclasses

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spin_usd.errors import GeometryError
from spin_usd.geometry import lens
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.geometry.transform import Transform
from tests.cases.scenes import BARREL, FOLDING, PINCUSHION, SMALL, SPEEDPLUS, unit_quaternions

PRINTED_PX = 5.1e-4  # half a unit of the third decimal that the reference values are printed with
CAMERAS = [SPEEDPLUS, BARREL, PINCUSHION, SMALL]

# The eleven official keypoints of Tango (speedplusbaseline, tangoPoints.mat), metres, body axes.
KEYPOINTS = np.array(
    [
        [-0.3700, -0.3850, 0.3215],
        [-0.3700, 0.3850, 0.3215],
        [0.3700, 0.3850, 0.3215],
        [0.3700, -0.3850, 0.3215],
        [-0.3700, -0.2640, 0],
        [-0.3700, 0.3040, 0],
        [0.3700, 0.3040, 0],
        [0.3700, -0.2640, 0],
        [-0.5427, 0.4877, 0.2535],
        [0.5427, 0.4877, 0.2591],
        [0.3050, -0.5790, 0.2515],
    ]
)
# Their pixels in SPEED+ pictures, without and with the lens, from labels and camera.json: synthetic img000014 ...
SYNTHETIC = {"q": [0.556984, -0.711815, 0.168095, -0.393487], "t": [-0.423949, -0.14451, 6.509727]}
SYNTHETIC_UV = np.array(
    [
        [739.477, 797.417, 739.956, 796.962, 6.705],
        [789.684, 696.860, 789.847, 696.757, 5.993],
        [1020.778, 453.563, 1020.741, 453.641, 6.269],
        [948.973, 574.972, 948.973, 574.972, 6.981],
        [638.824, 686.495, 639.679, 686.238, 6.616],
        [666.583, 603.933, 667.184, 603.906, 6.090],
        [899.477, 368.387, 899.552, 368.676, 6.366],
        [855.071, 465.603, 855.137, 465.684, 6.892],
        [713.586, 719.351, 714.039, 719.113, 5.838],
        [1060.893, 361.313, 1060.730, 361.671, 6.243],
        [893.927, 600.835, 893.933, 600.834, 7.142],
    ]
)
# ... and lightbox img000001, whose third keypoint lies outside the frame.
LIGHTBOX = {
    "q": [-0.152482913371, 0.30159953881, 0.937286943417, 0.085322125029],
    "t": [-0.060311131463, 0.146283907769, 2.697224827913],
}
LIGHTBOX_UV = {
    1: [856.315, 225.008, 856.664, 226.274],
    3: [732.940, 1463.984, 736.594, 1449.687],
    9: [1720.223, 1000.269, 1708.502, 993.961],
    11: [134.904, 492.176, 146.536, 493.548],
}


def rim(camera, steps=40):
    u, v = np.linspace(0, camera.width, steps), np.linspace(0, camera.height, steps)
    return np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)


def published_pixels(label, camera):
    pose = Transform.from_quaternion(to="cam", of="body", **label)
    return camera.project(pose.points(KEYPOINTS)), pose.points(KEYPOINTS)[:, 2]


def test_keypoints_of_a_synthetic_speedplus_picture() -> None:
    pinhole = dataclasses.replace(SPEEDPLUS, distortion=(0,) * 5)
    uv, z = published_pixels(SYNTHETIC, SPEEDPLUS)
    np.testing.assert_allclose(published_pixels(SYNTHETIC, pinhole)[0], SYNTHETIC_UV[:, :2], rtol=0, atol=PRINTED_PX)
    np.testing.assert_allclose(uv, SYNTHETIC_UV[:, 2:4], rtol=0, atol=PRINTED_PX)
    np.testing.assert_allclose(z, SYNTHETIC_UV[:, 4], rtol=0, atol=PRINTED_PX)


def test_keypoints_of_a_lightbox_speedplus_picture() -> None:
    pinhole = dataclasses.replace(SPEEDPLUS, distortion=(0,) * 5)
    rows = [i - 1 for i in LIGHTBOX_UV]
    both = np.concatenate([published_pixels(LIGHTBOX, c)[0][rows] for c in (pinhole, SPEEDPLUS)], 1)
    np.testing.assert_allclose(both, list(LIGHTBOX_UV.values()), rtol=0, atol=PRINTED_PX)


@given(unit_quaternions(), st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(3, 50)))
def test_project_is_opencvs(q, t) -> None:
    pose = Transform.from_quaternion(to="cam", of="body", q=q, t=t)
    rotation = Rotation.from_quat(q, scalar_first=True).as_rotvec()  # cv2.Rodrigues drops angles below 1e-5
    distortion = np.array(SPEEDPLUS.distortion)
    theirs = cv2.projectPoints(KEYPOINTS[:, None], rotation, pose.translation, SPEEDPLUS.matrix, distortion)[0][:, 0]
    np.testing.assert_allclose(SPEEDPLUS.project(pose.points(KEYPOINTS)), theirs, rtol=0, atol=1e-8)


@pytest.mark.parametrize("camera", CAMERAS)
def test_rays_are_opencvs(camera) -> None:
    uv = rim(camera)
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-16)
    theirs = cv2.undistortPoints(uv[:, None], camera.matrix, np.array(camera.distortion), criteria=stop)[:, 0]
    np.testing.assert_allclose(camera.normalised(uv), theirs, rtol=0, atol=1e-12)


@pytest.mark.parametrize("camera", [*CAMERAS, FOLDING])
def test_a_ray_projects_to_its_pixel_at_any_range(camera) -> None:
    uv = rim(camera)
    for z in (1e-3, 1, 1e7):
        np.testing.assert_allclose(camera.project(z * camera.rays(uv)), uv, rtol=0, atol=1e-9)


def test_the_first_pixels_centre_is_a_half() -> None:
    camera = Camera(width=2, height=2, fx=1, fy=1, cx=1, cy=1)
    np.testing.assert_array_equal(camera.centres(camera.frame)[0, 0], [-0.5, -0.5])


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("box", [(0, 0, 7, 5), (11, 3, 60, 40), (60, 44, 64, 48), (5, 5, 5, 9)])
def test_kept_centres_are_those_of_the_pixels(camera, box) -> None:
    x0, y0, x1, y1 = box
    u, v = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
    region = Region(x0=x0, y0=y0, x1=x1, y1=y1)
    np.testing.assert_allclose(camera.centres(region), camera.normalised(np.stack([u, v], -1)), rtol=0, atol=1e-15)


def test_centres_outside_the_frame_are_not_those_of_the_other_side() -> None:
    region = Region(x0=-2, y0=-1, x1=3, y1=2)
    back = SMALL.pixels(SMALL.centres(region))
    np.testing.assert_allclose(back[0, 0], [-1.5, -0.5], rtol=0, atol=1e-9)


def test_what_no_pixel_sees_has_no_pixel() -> None:
    """Behind the camera; in its plane; beyond the radius at which the lens model folds back into the frame."""
    beyond = 1.05 * lens.invertible_radius(SPEEDPLUS.distortion)
    assert np.isnan(SPEEDPLUS.project([[0, 0, -1], [1, 0, 0], [beyond, 0, 1]])).all()
    assert np.isfinite(SPEEDPLUS.project([[0, 0, 1e-300], [0.9 * beyond, 0, 1]])).all()


def test_a_lens_that_folds_inside_the_frame_is_found() -> None:
    BARREL.check_invertible()
    with pytest.raises(GeometryError, match="cannot be inverted"):
        dataclasses.replace(BARREL, distortion=(-0.8, 0, 0, 0, 0)).check_invertible()


@pytest.mark.parametrize("focal", [30.0, 3e3, 3e6])
def test_the_sentence_on_a_fold_says_where(focal) -> None:
    """For k1 alone the image ends at two thirds of the radius at which it folds, 1 / sqrt(-3 k1)."""
    fits, folds = (
        Camera(width=80, height=60, fx=focal, fy=focal, cx=40, cy=30, distortion=(k1, 0, 0, 0, 0))
        for k1 in (-4 / 27 * (focal / 50) ** 2 / (1 + s) for s in (1e-6, -0.2))
    )
    fits.check_invertible()
    assert np.isfinite(fits.centres(fits.frame)).all()
    with pytest.raises(GeometryError) as refusal:
        folds.check_invertible()
    assert f"folds back {50 * np.sqrt(0.8):.4g} px from the principal point, and the frame reaches 50 px" in str(
        refusal.value
    )


@pytest.mark.parametrize(
    "change",
    [
        {"fx": 0},
        {"fy": -1},
        {"fx": np.nan},
        {"cx": np.inf},
        {"width": 0},
        {"height": -3},
        {"width": 65537},
        {"width": 10.0},
        {"distortion": (0, 0, 0, 0)},
        {"distortion": (0, 0, 0, 0, np.nan)},
    ],
)
def test_bad_cameras_are_refused(change) -> None:
    with pytest.raises(GeometryError, match="camera"):
        dataclasses.replace(SMALL, **change)


def test_key_is_that_of_the_numbers() -> None:
    whole = Camera(width=8, height=6, fx=3, fy=4, cx=1, cy=2, distortion=(0, 0, 0, 0, 0))
    assert whole.key == Camera(width=8, height=6, fx=3.0, fy=4.0, cx=1.0, cy=2.0).key
    changed = [dataclasses.replace(SMALL, **{f.name: np.add(getattr(SMALL, f.name), 1).tolist()}) for f in dataclasses.fields(Camera) if f.name != "distortion"]  # fmt: skip  # noqa: E501
    changed += [dataclasses.replace(SMALL, distortion=tuple(0.1 * (i == j) for j in range(5))) for i in range(5)]
    assert len({c.key for c in [SMALL, *changed]}) == len(changed) + 1
