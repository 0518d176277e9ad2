"""Several bodies in Cycles: labels as the ray caster's, light between them, and pictures that depend on no other."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.body import Body
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from spin_usd.scene.scene import Shutter
from tests.cases.bodies import moved, three_bodies, without
from tests.cases.scenes import BARREL, box, pose, scene, target, with_first

EDGE_PIXELS = 3  # a ray along an edge may pass on either side of it
NOISE = 0.02  # of the mean over some hundred pixels, at 64 samples
SUN = DistantLight(path="/sun", direction_cam=(0.6, 0.0, 0.8), irradiance=(np.pi,) * 3)
SCENE = three_bodies(BARREL, lights=(SUN,))


def further(T_cam_body, metres):
    return pose(T_cam_body.quaternion, T_cam_body.translation + np.array([0, 0, metres]))


@pytest.mark.parametrize("away", [0.0, 200.0])
def test_labels_are_those_of_the_ray_caster(blender, away) -> None:
    """Near, where rays start at the camera, and so far that they start at each body."""
    far = replace(
        SCENE,
        camera=replace(BARREL, fx=BARREL.fx * (1 + away / 4), fy=BARREL.fy * (1 + away / 4), distortion=(0.0,) * 5),
        bodies=tuple(replace(body, T_cam_body=further(body.T_cam_body, away)) for body in SCENE.bodies),
    )
    ours, theirs = blender.visibility(far), EmbreeCaster().visibility(far)
    assert (ours.face != theirs.face).sum() <= EDGE_PIXELS
    assert set(visible_surface(far, ours).target.tolist()) == {0, 1, 2}
    for own, other in zip(ours.of_each_body, theirs.of_each_body, strict=True):
        assert (own.face != other.face).sum() <= EDGE_PIXELS


def test_labels_of_several_bodies_after_a_picture_of_one(blender) -> None:
    """What that picture hid of the bodies before it is there again."""
    theirs = EmbreeCaster().visibility(SCENE)
    blender.radiance(SCENE, Effort(samples=1), seed=0)
    blender.radiance(with_first(SCENE, others=()), Effort(samples=1), seed=0)
    assert (blender.visibility(SCENE).face != theirs.face).sum() <= EDGE_PIXELS


def test_bodies_shade_one_another_as_in_the_preview(blender) -> None:
    """A plate before a wall: where the preview has its hard shadow, and beside it, Cycles has the same light."""
    matt = Material(path="/m", diffuse_color=(0.5,) * 3, ior=1.0, roughness=1.0)
    wall = target(*box((-5, -5, 0), (5, 5, 0.1)), materials=[matt])
    plate = target(*box((-0.4, -0.4, -0.001), (0.4, 0.4, 0.001)), materials=[matt])
    other = Body(id=2, target=plate, T_cam_body=pose(t=(0, 0, 3)))
    lit = scene(wall, T_cam_body=pose(t=(0, 0, 5)), lights=[SUN], others=(other,))
    ours = blender.radiance(lit, Effort(samples=64, bounces=0), seed=1)
    theirs = RaycastRenderer().radiance(lit, Effort(samples=1), seed=1)
    dark = theirs.rgb[..., 0] == 0
    assert 50 < dark.sum() < 1000
    assert np.median(ours.rgb[..., 0][dark]) == 0  # in its edge's pixels there is some light
    assert ours.rgb.mean() == pytest.approx(theirs.rgb.mean(), rel=NOISE)
    assert ours.coverage.min() == 1


def test_a_picture_does_not_depend_on_those_before_it(blender) -> None:
    """Labels, other poses and other numbers of bodies come between."""
    effort = Effort(samples=2)
    first = blender.radiance(SCENE, effort, seed=3)
    faces = blender.visibility(SCENE).face
    others = (moved(SCENE, 1, pose(t=(0.2, 0, 3.5))), without(SCENE, 2), with_first(SCENE, others=()))
    for other in others:
        blender.visibility(other)
        blender.radiance(other, effort, seed=4)
        np.testing.assert_array_equal(blender.radiance(SCENE, effort, seed=3).groups, first.groups)
        np.testing.assert_array_equal(blender.visibility(SCENE).face, faces)


def test_each_body_moves_on_its_own_while_the_shutter_is_open(blender) -> None:
    """The second is blurred along its way, over which its coverage is spread; what stands still is as sharp as ever."""
    alone = replace(SCENE, bodies=SCENE.bodies[:2])
    steps = [pose((0.7, -0.2, 0.5, 0.1), (0.35 + 0.1 * (i - 1), 0.1, 3.0)) for i in range(3)]
    first, second = alone.bodies
    still = replace(first, poses=(first.T_cam_body,) * 3)
    moving = replace(alone, shutter=Shutter(), bodies=(still, replace(second, poses=tuple(steps))))
    sharp, blurred = (blender.radiance(each, Effort(samples=16), seed=1).coverage for each in (alone, moving))
    assert moving.picture_region.width > alone.picture_region.width
    partly = (blurred > 0.1) & (blurred < 0.9)
    assert partly.sum() > 2 * ((sharp > 0.1) & (sharp < 0.9)).sum()
    np.testing.assert_array_equal(blender.visibility(moving).face, blender.visibility(alone).face)
