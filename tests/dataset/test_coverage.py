"""What share of a picture the target covers, as estimated for costs, against what a renderer finds."""

import numpy as np
import pytest

from spin_usd.dataset.coverage import Coverage
from spin_usd.render.raycast import RaycastRenderer
from spin_usd.stage.read import StageReader

OFF = 0.1  # of the pixels that are there: sides 13 degrees apart, and at this size many pixels are edges


def test_the_estimate_is_near_what_a_renderer_finds(small_stage):
    reader, coverage, renderer = StageReader(small_stage), Coverage(), RaycastRenderer()
    for frame in reader.frames:
        scene = reader.scene(frame)
        found = np.count_nonzero(renderer.visibility(scene).face >= 0)
        assert coverage.target_pixels(scene) == pytest.approx(found, rel=OFF)
