"""The preview of several bodies: they hide and shade one another, by hand-computed places of a shadow."""

import numpy as np

from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.body import Body
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from tests.cases.scenes import box, pose, scene, target

# A wall at z = 5 and a small box at z = 3, half of it left of the optical axis, in light that falls to the right.
SUN = DistantLight(path="/sun", direction_cam=(0.6, 0.0, 0.8), irradiance=(np.pi,) * 3)
WALL = target(*box((-5, -5, 0), (5, 5, 0.1)))
SMALL_BOX = target(*box((-0.2, -0.2, -0.001), (0.2, 0.2, 0.001)))


def radiance(*others):
    lit = scene(WALL, T_cam_body=pose(t=(0, 0, 5)), lights=[SUN], others=others)
    return RaycastRenderer().radiance(lit, Effort(samples=1), seed=0).rgb[..., 0], lit


def test_a_body_casts_its_shadow_on_another() -> None:
    """The ray from the wall's point (x, y, 5) to the Sun meets z = 3 at x - 1.5."""
    image, lit = radiance(Body(id=2, target=SMALL_BOX, T_cam_body=pose((0.8, 0, 0.6, 0), (0, 0, 3))))
    rotated, _ = radiance(Body(id=2, target=SMALL_BOX, T_cam_body=pose(t=(0, 0, 3))))
    plain, _ = radiance()
    xy = lit.camera.centres(lit.camera.frame)
    wall = 5 * xy
    shadow = (np.abs(wall[..., 0] - 1.5) < 0.19) & (np.abs(wall[..., 1]) < 0.19)
    lit_up = (np.abs(wall[..., 0] - 1.5) > 0.23) & (np.abs(3 * xy[..., 0]) > 0.22) & (wall[..., 0] > -4)
    assert shadow.sum() > 10
    assert not rotated[shadow].any()
    np.testing.assert_array_equal(rotated[lit_up], plain[lit_up])
    assert (image[lit_up] == plain[lit_up]).mean() > 0.95  # turned, it is narrower and reaches elsewhere


def test_a_body_out_of_the_frame_still_shades() -> None:
    image, lit = radiance(Body(id=0, target=SMALL_BOX, T_cam_body=pose(t=(-2, 0, 3))))
    assert lit.one_body_scenes[1].region.empty
    wall = 5 * lit.camera.centres(lit.camera.frame)
    shadow = (np.abs(wall[..., 0] + 0.5) < 0.19) & (np.abs(wall[..., 1]) < 0.19)
    assert shadow.sum() > 10
    assert not image[shadow].any()
