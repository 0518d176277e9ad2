"""Every case's labels against the truth: within the roundings of float64 and float32, in both renderers."""

import cv2
import numpy as np
import pytest
from extremes import exact
from extremes.cases import CASES
from extremes.judged import judged

SEEN = 30  # pixels that a case must show, or it would prove nothing
OPENCV_PX = 1e-9  # OpenCV's doubles


@pytest.mark.parametrize("case", CASES, ids=str)
def test_labels_are_within_what_arithmetic_allows(case, renderer):
    found = judged(case, renderer)
    assert found.seen >= SEEN
    assert found.unexcused == 0
    for quantity, errors in found.errors.items():
        assert len(errors) >= SEEN - found.wrong
        assert (errors <= found.bounds[quantity]).all(), (quantity, float((errors / found.bounds[quantity]).max()))


@pytest.mark.parametrize("case", [case for case in CASES if case.group == "lens"], ids=str)
def test_the_truth_sees_through_lenses_as_opencv_does(case):
    camera = case.camera
    rays = np.concatenate([exact.pixel_rays(camera), np.ones((camera.width * camera.height, 1))], 1).astype(float)
    uv = cv2.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), camera.matrix, np.array(camera.distortion))[0]
    v, u = np.mgrid[0 : camera.height, 0 : camera.width] + 0.5
    np.testing.assert_allclose(uv[:, 0], np.stack([u, v], -1).reshape(-1, 2), rtol=0, atol=OPENCV_PX)


def test_the_truth_is_finer_than_what_it_judges():
    if exact.HALF_ULP > 2.0**-60:
        pytest.skip("this machine's longdouble is a double")
    assert exact.HALF_ULP <= 2.0**-64
