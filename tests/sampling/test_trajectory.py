"""Trajectories: what the camera sees of bodies that fall and turn, and where the Sun is."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.sampling.attitudes import Attitudes
from spin_usd.sampling.distribution import Directions, Fixed, Normal, Uniform
from spin_usd.sampling.poses import Inside, OffsetLaw, PositionLaw
from spin_usd.sampling.relative_motion import Approach, FreeFall, RelativeOrbit
from spin_usd.sampling.sample import stream
from spin_usd.sampling.trajectory import Chaser, TrajectoryLaw, Transfer
from spin_usd.sampling.turning import Spin, Tumble

CAMERA = Camera(width=1440, height=1080, fx=1745, fy=1747, cx=737, cy=528)
PERIOD = 5900.0
N = 2 * math.pi / PERIOD
HULL = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])


AROUND, FRAME = Normal(mean=0, sigma=100), (CAMERA.width, CAMERA.height)


def law(**changes):
    place = OffsetLaw(across=AROUND, down=AROUND, frame=FRAME)
    ends = [PositionLaw(range=Uniform(low=1.5, high=10), place=place) for _ in range(2)]
    spin = Spin(degrees=Fixed(value=1.5), axis=Directions())
    fields = {"path": Transfer(start=ends[0], end=ends[1]), "spin": spin, "attitude": Attitudes(), "step": 0.1}
    return TrajectoryLaw(**fields | {"period": 5900.0, "range": (1.5, 10.0), "inside": Inside(least=1.0)} | changes)


def test_pictures_follow_one_another_steadily() -> None:
    q, t = law().sample(stream(1, "a"), CAMERA, HULL, 100)
    turned = Rotation.from_quat(q, scalar_first=True)
    assert np.allclose(np.degrees((turned[:-1].inv() * turned[1:]).magnitude()), 1.5)
    steps = np.diff(t, axis=0)
    assert np.abs(np.diff(steps, axis=0)).max() < 1e-3 * np.abs(steps).max()  # ten seconds bend no path


def test_the_body_turns_about_its_centre_of_mass() -> None:
    mass = np.array([0.0, 0.02, 0.16])
    still = RelativeOrbit(forward=8)
    q, t = law(path=still, centre_of_mass=tuple(mass)).sample(stream(1, "a"), CAMERA, HULL, 50)
    middle = Rotation.from_quat(q, scalar_first=True).apply(mass) + t
    assert np.allclose(middle, [0, 0, 8])
    assert np.ptp(t, axis=0).max() > 0.05


def test_a_tilted_camera_sees_the_target_where_it_was_turned_from() -> None:
    _, t = law(path=RelativeOrbit(forward=8), tilt=(0.01, 0.0)).sample(stream(1, "a"), CAMERA, HULL, 1)
    assert t[0] == pytest.approx([0, 8 * math.sin(0.01), 8 * math.cos(0.01)])  # turned up: what is ahead moves down


def test_what_cannot_stay_in_the_picture_is_said() -> None:
    with pytest.raises(InputError, match="none of 1000 sequences"):
        law(path=RelativeOrbit(forward=8), range=(1, 2)).sample(stream(1, "a"), CAMERA, HULL, 2)


def chasing(motion, **changes):
    still = Spin(degrees=Fixed(value=0.0), axis=Fixed(value=(0.0, 0.0, 1.0)))
    fields = {"path": Chaser(motion=motion), "spin": still, "attitude": Fixed(value=(1.0, 0.0, 0.0, 0.0))}
    return TrajectoryLaw(**fields | {"step": 100.0, "period": PERIOD} | changes)


ELLIPSE = RelativeOrbit(forward=0.0, eccentric=8.0, inclined=4.0)


def test_the_camera_points_at_the_target_from_wherever_it_is() -> None:
    _, t = chasing(ELLIPSE).sample(stream(1, "a"), CAMERA, HULL, 60)
    assert np.abs(t[:, :2]).max() < 1e-12
    assert t[:, 2] == pytest.approx(np.linalg.norm(ELLIPSE.places(N, 100.0 * np.arange(60)), axis=1))


def test_a_craft_that_holds_behind_sees_what_one_that_looks_along_its_flight_sees() -> None:
    behind = chasing(RelativeOrbit(forward=-8.0)).sample(stream(1, "a"), CAMERA, HULL, 5)
    along = chasing(None, path=RelativeOrbit(forward=8.0)).sample(stream(1, "a"), CAMERA, HULL, 5)
    for mine, theirs in zip(behind, along, strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-12)


def test_the_stars_turn_once_an_orbit_before_a_craft_that_holds() -> None:
    """Behind the target, looking forward: a Sun ahead at the start is overhead (-y) a quarter of an orbit later."""
    law = chasing(RelativeOrbit(forward=-8.0), sun=Fixed(value=(0.0, 1.0, 0.0)), step=PERIOD / 4)
    suns = law.sun_directions(stream(1, "a"), 5)
    want = [[0, 0, 1], [0, -1, 0], [0, 0, -1], [0, 1, 0], [0, 0, 1]]
    assert suns == pytest.approx(np.array(want), abs=1e-12)


def test_a_body_that_does_not_turn_among_the_stars_keeps_its_face_to_the_sun() -> None:
    still = Tumble(rate=Fixed(value=0.0), axis=Directions(), inertia=((2.0, 0, 0), (0, 3.0, 0), (0, 0, 4.0)))
    law = chasing(ELLIPSE, spin=still, sun=Directions(), attitude=Attitudes())
    q, _ = law.sample(stream(1, "a"), CAMERA, HULL, 40)
    towards = Rotation.from_quat(q, scalar_first=True).inv().apply(law.sun_directions(stream(2, "a"), 40))
    assert np.ptp(towards, axis=0).max() < 1e-9


def test_an_approach_comes_straight_along_the_radius() -> None:
    """From below: the camera sees the target, and its own right is against the orbit's normal."""
    law = chasing(Approach(start=(-30.0, 0.0, 0.0), end=(-5.0, 0.0, 0.0)))
    q, t = law.sample(stream(1, "a"), CAMERA, HULL, 6)
    assert t[:, 2] == pytest.approx([30, 25, 20, 15, 10, 5])
    assert (q == q[0]).all()


def test_free_fall_from_rest_above_moves_behind() -> None:
    """A higher orbit is slower."""
    places = FreeFall(place=(10.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0)).places(N, np.array([0.0, 60.0]))
    assert places[0].tolist() == [10, 0, 0]
    assert places[1, 0] > 10
    assert places[1, 1] < 0


def test_a_camera_at_the_target_is_refused() -> None:
    with pytest.raises(InputError, match="at the target's centre of mass"):
        chasing(RelativeOrbit(forward=0.0)).sample(stream(1, "a"), CAMERA, HULL, 2)


def test_a_camera_may_look_along_the_orbits_normal() -> None:
    law = chasing(Approach(start=(0.0, 0.0, 9.0), end=(0.0, 0.0, 5.0)))
    assert law.sample(stream(1, "a"), CAMERA, HULL, 3)[1][:, 2] == pytest.approx([9, 7, 5])
