"""BOP's conventions by hand: millimetres, rows before columns, boxes, pixel centres, whole numbers of depth."""

import numpy as np
import pytest

from spin_usd.errors import UnsupportedError
from spin_usd.exchange.bop_scenes import (
    camera_matrix,
    model_entry,
    pose_entry,
    visibility_entry,
)
from spin_usd.exchange.layout.images import depth_numbers
from spin_usd.exchange.layout.models import Model
from spin_usd.geometry.camera import Camera

QUARTER_TURN = np.sqrt(0.5) * np.array([1, 0, 0, 1])  # about z: x to y, scalar first


def test_k_is_in_pixels_with_centres_at_whole_numbers() -> None:
    camera = Camera(width=1920, height=1200, fx=3000, fy=2000, cx=960, cy=600)
    assert camera_matrix(camera, first_centre=0.0) == [3000, 0, 959.5, 0, 2000, 599.5, 0, 0, 1]
    assert camera_matrix(camera, first_centre=0.5) == [3000, 0, 960, 0, 2000, 600, 0, 0, 1]


def test_poses_are_rows_and_millimetres() -> None:
    entry = pose_entry(2, QUARTER_TURN, np.array([0.1, -0.2, 3]))
    np.testing.assert_allclose(entry["cam_R_m2c"], [0, -1, 0, 1, 0, 0, 0, 0, 1], atol=1e-15)
    assert entry["cam_t_m2c"] == [100, -200, 3000]
    assert entry["obj_id"] == 2


def test_visibility_is_counted_as_bop_toolkit_counts_it() -> None:
    """A silhouette of 3 x 4 pixels of which the left 2 columns are seen, and as much again is out of the frame."""
    amodal, visible = np.zeros((8, 9), bool), np.zeros((8, 9), bool)
    amodal[2:6, 6:9] = True
    visible[2:6, 6:8] = True
    outline = np.array([[5.6, 2.4], [12.4, 1.8], [11.3, 6.4]])
    found = visibility_entry(visible=visible, amodal=amodal, fraction=8 / 24, outline=outline)
    assert found == {
        "bbox_obj": [6, 2, 5, 3],  # centres in columns 6.5 to 11.5, rows 2.5 to 5.5: the greatest less the least
        "bbox_visib": [6, 2, 1, 3],
        "px_count_all": 24,
        "px_count_valid": 12,
        "px_count_visib": 8,
        "visib_fract": 8 / 24,
    }


def test_what_nothing_is_seen_of_has_no_box() -> None:
    none = np.zeros((2, 2), bool)
    found = visibility_entry(visible=none, amodal=none, fraction=float("nan"), outline=np.zeros((1, 2)))
    assert found["bbox_obj"] == found["bbox_visib"] == [-1, -1, -1, -1]
    assert (found["px_count_all"], found["visib_fract"]) == (0, 0.0)


def test_a_model_is_measured_in_millimetres() -> None:
    points = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.4, 0], [0, 0, -1.2]])
    model = Model(points=points, faces=np.array([[0, 1, 2]], np.int32), face_part=np.ones(1, np.uint16))
    found = model_entry(model)
    assert found.pop("diameter") == pytest.approx(np.hypot(1200, 400))
    wanted = {"min_x": 0, "min_y": 0, "min_z": -1200, "size_x": 300, "size_y": 400, "size_z": 1200}
    assert found == pytest.approx(wanted)


def test_depth_is_whole_steps() -> None:
    depth = np.array([[0, 1.0004, 6.5535]], np.float32)
    assert depth_numbers(depth, 0.1).tolist() == [[0, 10004, 65535]]
    assert depth_numbers(depth, 1.0).tolist() == [[0, 1000, 6554]]
    with pytest.raises(UnsupportedError, match=r"up to 6.5536 m deep, and 16 bits of 0.1 mm end at 6.5535 m"):
        depth_numbers(np.array([[6.5536]], np.float32), 0.1)
