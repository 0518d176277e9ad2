"""Scenes of two targets and an occluder, one before another."""

from dataclasses import replace

from spin_usd.scene.body import Body
from tests.cases import scenes

TILTED = (0.9, 0.3, -0.2, 0.25)


def three_bodies(camera=scenes.SMALL, **fields):
    """A box, another one before half of it, and an arm before both."""
    first = scenes.target(*scenes.box())
    second = scenes.target(*scenes.box((-0.3,) * 3, (0.3,) * 3), parts=[*[1] * 6, *[2] * 6])
    arm = scenes.target(*scenes.box((-1, -0.03, -0.03), (1, 0.03, 0.03)))
    others = (
        Body(id=2, target=second, T_cam_body=scenes.pose((0.7, -0.2, 0.5, 0.1), (0.35, 0.1, 3.0))),
        Body(id=0, target=arm, T_cam_body=scenes.pose(t=(0, 0.15, 1.5))),
    )
    T_cam_body = scenes.pose(TILTED, (0, 0, 4))
    return scenes.scene(first, camera=camera, T_cam_body=T_cam_body, others=others, **fields)


def without(scene, place):
    """The same scene without the body at `place`, which is not the first."""
    return replace(scene, bodies=tuple(body for i, body in enumerate(scene.bodies) if i != place))


def moved(scene, place, T_cam_body):
    """The same scene with another pose of the body at `place`, which is not the first."""
    bodies = [replace(b, T_cam_body=T_cam_body) if i == place else b for i, b in enumerate(scene.bodies)]
    return replace(scene, bodies=tuple(bodies))
