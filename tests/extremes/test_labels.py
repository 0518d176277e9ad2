"""Every case's labels against the truth: within the roundings of float64 and float32, by both passes."""

import json
from dataclasses import replace
from functools import lru_cache
from itertools import product

import cv2
import numpy as np
import pytest
import trimesh

from tests.conftest import REPOSITORY
from tests.extremes import exact
from tests.extremes.cases import CASES, Case, camera
from tests.extremes.judged import judged

REPORT = REPOSITORY / "tools" / "figures" / "extremes.json"  # of tools/report_extremes
ROWS = {
    (f"{row['extreme']}: {row['case']}", row["pass"]): row for row in json.loads(REPORT.read_text()) if "extreme" in row
}
THREE_DIGITS = 6e-3  # as the report has them
SEEN = 30  # pixels that a case must show, or it would prove nothing
OPENCV_PX = 1e-9  # OpenCV's doubles


@pytest.mark.parametrize("case", CASES, ids=str)
def test_labels_are_within_what_arithmetic_allows_and_are_what_the_report_says(case, label_pass) -> None:
    found = judged(case, label_pass)
    row = ROWS[str(case), label_pass.name]
    assert (row["pixels"], row["within_float32"]) == (found.seen, found.near)
    assert found.seen >= SEEN
    assert found.unexcused == 0
    for quantity, errors in found.errors.items():
        assert len(errors) >= SEEN - found.wrong
        assert (errors <= found.bounds[quantity]).all(), (quantity, float((errors / found.bounds[quantity]).max()))
        assert row[quantity]["bound"] == pytest.approx(found.bounds[quantity].max(), rel=THREE_DIGITS)


@pytest.mark.parametrize("case", [case for case in CASES if case.group == "lens"], ids=str)
def test_the_truth_sees_through_lenses_as_opencv_does(case) -> None:
    camera = case.camera
    rays = np.concatenate([exact.pixel_rays(camera), np.ones((camera.width * camera.height, 1))], 1).astype(float)
    uv = cv2.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), camera.matrix, np.array(camera.distortion))[0]
    v, u = np.mgrid[0 : camera.height, 0 : camera.width] + 0.5
    np.testing.assert_allclose(uv[:, 0], np.stack([u, v], -1).reshape(-1, 2), rtol=0, atol=OPENCV_PX)


def test_the_report_has_no_other_cases() -> None:
    assert set(ROWS) == set(product(map(str, CASES), ("embree", "blender")))


def test_the_truth_is_finer_than_what_it_judges() -> None:
    if exact.HALF_ULP > 2.0**-60:
        pytest.skip("this machine's longdouble is a double")
    assert exact.HALF_ULP <= 2.0**-64


@pytest.mark.slow
@pytest.mark.parametrize(("away", "focal"), [(5.0, 4e-4), (1e5, 8.0)])
def test_a_real_mesh(shared, label_pass, away, focal) -> None:
    """23,360 faces of a model as it was built, needles and shared surfaces among them."""
    case = tango(shared / "data" / "tango" / "tango.obj", away, focal)
    found = judged(case, label_pass)
    assert found.seen >= SEEN
    assert found.unexcused == 0
    assert all((errors <= found.bounds[quantity]).all() for quantity, errors in found.errors.items())


@lru_cache
def tango(file, away, focal):
    """Once for both passes, so that its truth is. The file's unit is the centimetre."""
    model: trimesh.Trimesh = trimesh.load_mesh(file, process=False)
    through = replace(camera(focal), width=16, height=12, cx=8.3, cy=5.7)
    mesh = np.asarray(model.vertices) / 100, np.asarray(model.faces)
    return Case(group="real", name="Tango", camera=through, mesh=mesh, t=(0.0, 0.0, away))
