"""Of faces that lie in one another the one with the lowest number is seen."""

import numpy as np
import pytest

from spin_usd.renderers.embree.caster import EmbreeCaster
from tests.cases.scenes import BARREL, box, pose, scene, target

POINTS, FACES = box()
HERE = pose((0.9, 0.3, 0.2, 0.1), (0.2, -0.1, 5))


@pytest.mark.parametrize("count", [2, 4])
@pytest.mark.parametrize("seed", range(3))
def test_of_boxes_in_one_another_the_lowest_number_is_seen_in_any_order(count, seed) -> None:
    """Their faces shuffled, and each box's split by other diagonals, seen or not: in each pixel the lowest number of
    those that a box alone shows."""
    rng = np.random.default_rng(seed)
    of_box = np.repeat(np.arange(count), len(FACES))
    order = rng.permutation(len(of_box))
    faces = np.concatenate([FACES + len(POINTS) * i for i in range(count)])[order]
    points = np.concatenate([POINTS] * count)
    caster = EmbreeCaster()
    together = caster.visibility(scene(target(points, faces), camera=BARREL, T_cam_body=HERE)).face
    alone = []
    for i in range(count):
        own = np.flatnonzero(of_box[order] == i)
        seen = caster.visibility(scene(target(points, faces[own]), camera=BARREL, T_cam_body=HERE)).face
        alone.append(np.where(seen >= 0, own[seen], -1))
    lowest = np.min(alone, axis=0)
    assert (lowest >= 0).sum() > 3000
    assert (together != lowest).sum() <= 2  # pixels on an edge between faces of one box


def test_a_face_that_stands_there_1100_times_is_the_first() -> None:
    """Embree crashes with a scene for each of them."""
    faces = np.tile(FACES[:1], (1100, 1))
    seen = EmbreeCaster().visibility(scene(target(POINTS, faces), camera=BARREL, T_cam_body=HERE)).face
    assert set(np.unique(seen)) == {-1, 0}
