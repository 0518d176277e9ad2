"""Time steps: nothing moves by more than half a pixel in one, and where they lie depends on nothing but the stage."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from spin_usd.events.time_steps import bodies_moved, flickered, sky_moved, time_steps
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.geometry.transform import Transform
from spin_usd.scene.environment import Environment, Stars


def test_no_point_of_a_body_moves_by_more_than_half_a_pixel(moving) -> None:
    assert set(moving.pictures) <= set(moving.steps)
    assert all(after > before for before, after in pairwise(moving.steps))
    for before, after in pairwise(moving.steps):
        first, last = moving.at(before), moving.at(after)
        body = first.bodies[0].target.mesh.points
        apart = last.camera.project(last.bodies[0].T_cam_body.points(body)) - first.camera.project(
            first.bodies[0].T_cam_body.points(body)
        )
        assert np.hypot(*apart.T).max() <= 0.5


def test_steps_are_no_finer_than_that_asks_for(moving) -> None:
    pairs = zip(moving.steps, moving.steps[2:], strict=False)
    assert np.mean([bodies_moved(moving.at(before), moving.at(after)) for before, after in pairs]) > 0.5


def test_a_part_of_the_pictures_has_the_same_steps(moving) -> None:
    middle = moving.pictures[2]
    parts = [list(time_steps(moving.at, moving.pictures[:3])), list(time_steps(moving.at, moving.pictures[2:]))]
    assert [*parts[0], *parts[1][1:]] == moving.steps
    assert parts[0][-1] == middle


def test_a_lamp_that_is_switched_on_is_found_in_time(moving) -> None:
    scene = moving.at(0.0)

    def lit(seconds):
        lights = tuple(
            replace(light, irradiance=(1.0, 1.0, 1.0) if seconds > 0.3 else (0.0,) * 3) for light in scene.lights
        )
        return scene.with_lights(lights)

    steps = list(time_steps(lit, [0.0, 1.0]))
    at = int(np.searchsorted(steps, 0.3, "right"))
    assert steps[at] - steps[at - 1] < 2e-6
    assert flickered(lit(0.2), lit(0.4)) > 1


@pytest.mark.parametrize("angle", [1e-4, 1e-3])
def test_stars_move_by_the_angle_times_the_focal_length(moving, angle) -> None:
    scene, direction = moving.at(0.0), np.array([[0.0, 0.0, 1.0]])

    def turned(by):
        T = Transform(
            to="cam",
            of="sky",
            rotation=matrix_from_quaternion([np.cos(by / 2), 0, np.sin(by / 2), 0]),
            translation=np.zeros(3),
        )
        stars = Stars(path="/Stars", T_cam_sky=T, directions=direction, irradiance=np.ones((1, 3)))
        return replace(scene, environment=Environment(stars=(stars,)))

    assert sky_moved(turned(0.0), turned(angle)) == pytest.approx(angle * scene.camera.fx, rel=1e-6)
