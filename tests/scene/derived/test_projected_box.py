"""The box of projected edges against points sampled densely along them, through every kind of lens."""

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.scene.derived.surface_box import box_of_edges, box_of_points, rim_of_lens, seen_by_lens
from tests.cases.scenes import BARREL, FOLDING, PINCUSHION, SPEEDPLUS, pose

PLAIN = Camera(width=320, height=240, fx=300, fy=310, cx=150, cy=110)
CAMERAS = {"plain": PLAIN, "speedplus": SPEEDPLUS, "barrel": BARREL, "pincushion": PINCUSHION, "folding": FOLDING}
SAMPLES = np.linspace(0, 1, 4001)[:, None]
CUT_PX = 0.3  # where an edge ends at the rim of the lens, the last sample may be so far before it
FAR_PX = 1000  # beyond, samples are too sparse: the camera's plane is near


@pytest.mark.parametrize("name", CAMERAS)
def test_it_is_tight_around_what_the_lens_sees_of_edges(name) -> None:
    camera, judged = CAMERAS[name], 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        turned = pose(rng.normal(size=4), t=(*rng.uniform(-1, 1, 2), rng.uniform(-1, 6)))
        points, edges = turned.points(rng.uniform(-1, 1, (24, 3))), np.arange(24).reshape(-1, 2)
        box = box_of_edges(camera, points, edges)
        pixels = camera.project(np.concatenate([points[a] + SAMPLES * (points[b] - points[a]) for a, b in edges]))
        pixels = pixels[np.isfinite(pixels).all(1)]
        if not len(pixels):
            assert not np.isfinite(box).any()
            continue
        sampled = np.stack([pixels.min(0), pixels.max(0)])
        near = np.abs(sampled) < FAR_PX
        beyond = (box - sampled)[near] * np.broadcast_to([[-1], [1]], (2, 2))[near]
        assert beyond.min(initial=0) > -1e-6
        assert beyond.max(initial=0) < CUT_PX
        judged += int(near.sum())
    assert judged >= 10


def test_a_straight_edge_bows_beyond_its_ends() -> None:
    ends = np.array([[-0.6, 0.4, 2], [0.6, 0.4, 2]])
    box = box_of_edges(BARREL, ends, np.array([[0, 1]]))
    assert box[1, 1] > BARREL.project(ends)[:, 1].max() + 0.9
    assert box[1, 1] == pytest.approx(BARREL.project(ends[0] + SAMPLES * (ends[1] - ends[0]))[:, 1].max(), abs=1e-4)


def test_nothing_behind_the_camera_or_beyond_the_lens_counts() -> None:
    behind, beyond = np.array([[0, 0, -1], [0.1, 0, -2.0]]), np.array([[8, 0, 1], [9, 1, 1.0]])
    for points in (behind, beyond):
        assert not seen_by_lens(FOLDING, points).any()
        assert not np.isfinite(box_of_points(FOLDING, points)).any()
        assert not np.isfinite(box_of_edges(FOLDING, points, np.array([[0, 1]]))).any()


def test_the_rim_is_as_far_out_as_the_lens_sees() -> None:
    rim = rim_of_lens(FOLDING, 8)
    on_rays = np.concatenate([rim, np.ones((8, 1))], axis=1)
    assert np.isfinite(FOLDING.project(on_rays)).all()
    assert np.isnan(FOLDING.project(on_rays * (1 + 1e-8, 1 + 1e-8, 1))).all()
    assert not len(rim_of_lens(PLAIN, 8))
