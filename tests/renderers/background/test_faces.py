"""Points on the faces of a cube around a sphere, on which noise lies."""

import numpy as np

from spin_usd.renderers.background.noise_octaves import faces_of

STEP = 1e-3  # radians
BENT = 3 * STEP**2  # faces are flat to the first order: what a and b bend by in a step is of the second


def test_points_moved_on_their_faces_are_those_that_moved_on_the_sphere() -> None:
    rng = np.random.default_rng(3)
    here = rng.normal(size=(3, 200))
    here /= np.linalg.norm(here, axis=0)
    way = np.cross(here, rng.normal(size=(3, 200)), axis=0)
    way /= np.linalg.norm(way, axis=0)
    before = faces_of(list(here), [list(way)])
    after = faces_of(list(here * np.cos(STEP) + way * np.sin(STEP)))
    assert [face.number for face in before] == [face.number for face in after] == list(range(6))
    for old, new in zip(before, after, strict=True):
        assert old.share is not None
        moved = old.moved(0, STEP)
        # Beyond the face itself, where it overlaps with its neighbours, both are near enough to what they stand for.
        own = (old.share > 0) & (np.abs(new.a) < np.pi / 4) & (np.abs(new.b) < np.pi / 4)
        np.testing.assert_allclose(moved.a[own], new.a[own], rtol=0, atol=BENT)
        np.testing.assert_allclose(moved.b[own], new.b[own], rtol=0, atol=BENT)
