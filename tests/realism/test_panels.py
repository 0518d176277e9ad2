"""Panels and Suns around a target: where they stand, and the light that they give."""

from itertools import pairwise

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.realism.panels import (
    DISTANCE,
    LEAST_M,
    WIDTH,
    directions,
    facing,
    is_wall,
    light_around,
    light_towards,
    names_around,
    names_near,
    scaled,
)
from spin_usd.scene.light import DistantLight, DomeLight, RectLight

COUNT = 42
CENTRE = np.array([0.3, -0.2, -7.0])
RADIUS = 0.8


def light(name, count=COUNT):
    return light_around(name, CENTRE, RADIUS, count)


def irradiance(panel, steps=40):
    """Irradiance at the centre of a plane that faces the panel's middle: by summing over the panel."""
    u = (np.arange(steps) + 0.5) / steps - 0.5
    x, y = (each.ravel() for each in np.meshgrid(u * panel.width, u * panel.height))
    points = panel.T_cam_light.points(np.stack([x, y, np.zeros_like(x)], -1))
    away = points - CENTRE
    distance = np.linalg.norm(away, axis=1)
    normal, _ = light_towards(panel, CENTRE)
    towards = away / distance[:, None]
    leaving = (-towards) @ panel.T_cam_light.rotation  # in the light's own axes
    area = panel.projected_area(leaving) / steps**2
    return float((panel.emission[0] * area / distance**2 * (towards @ normal)).sum())


def of_a_square(radiance, side, distance):
    """The same in closed form: four rectangles that begin at the middle (configuration factor of a differential element
    to a parallel rectangle; Howell, Menguc, "A catalog of radiation heat transfer configuration factors", B-3)."""
    x = side / 2 / distance
    return 4 * radiance * x / np.sqrt(1 + x * x) * np.arctan(x / np.sqrt(1 + x * x))


def test_names_are_many_and_each_is_one_light() -> None:
    names = names_around(COUNT)
    assert len(set(names)) == len(names) == 2 * COUNT + 6
    assert names_around(0) == ()
    for name in (*names, *names_near(names[5]), *names_near("Sun041")):
        one, again = light(name), light(name)
        assert one.path == again.path == name
        assert light_towards(one, CENTRE)[0].tolist() == light_towards(again, CENTRE)[0].tolist()


@pytest.mark.parametrize("name", names_around(COUNT)[: 2 * COUNT : COUNT // 6])
def test_each_light_gives_one_watt(name) -> None:
    one = light(name)
    if isinstance(one, DistantLight):
        assert one.irradiance == (1, 1, 1)
        assert np.linalg.norm(one.direction_cam) == pytest.approx(1)
        return
    assert isinstance(one, RectLight)
    distance = light_towards(one, CENTRE)[1]
    assert irradiance(one) == pytest.approx(of_a_square(one.emission[0], one.width, distance), rel=1e-3)
    assert irradiance(one) == pytest.approx(1, abs=WIDTH**2 / 2)  # a small source's; its corners are farther


def test_a_smaller_and_a_larger_panel_give_as_much() -> None:
    *_, smaller, larger = names_near("Panel007")
    panels = [light(name) for name in (smaller, "Panel007", larger)]
    widths = [panel.width for panel in panels]
    assert all(a < b for a, b in pairwise(widths))
    for panel in panels:
        assert irradiance(panel) == pytest.approx(1, abs=2 * WIDTH**2)


def test_panels_face_the_target() -> None:
    for name in names_around(COUNT)[:COUNT]:
        panel = light(name)
        assert isinstance(panel, RectLight)
        towards, distance = light_towards(panel, CENTRE)
        assert distance == pytest.approx(max(DISTANCE * RADIUS, LEAST_M))
        assert -panel.T_cam_light.rotation[:, 2] == pytest.approx(-towards, abs=1e-12)
        assert distance > 2 * RADIUS  # beyond the target, wherever its parts are


def test_six_walls_are_a_closed_room() -> None:
    """The light from all sides: their solid angles are the sphere, so a plane in it gets pi times their radiance."""
    walls = [light(name) for name in names_around(COUNT) if is_wall(name)]
    assert len(walls) == 6
    steps = (np.arange(60) + 0.5) / 60 - 0.5
    x, y = (each.ravel() for each in np.meshgrid(steps, steps))
    sphere, onto = 0.0, 0.0
    for wall in walls:
        assert isinstance(wall, RectLight)
        away = wall.T_cam_light.points(np.stack([x * wall.width, y * wall.height, 0 * x], -1)) - CENTRE
        distance = np.linalg.norm(away, axis=1)
        cosine = (away @ wall.T_cam_light.rotation)[:, 2] / distance
        solid = np.abs(cosine) * wall.width * wall.height / 60**2 / distance**2
        sphere += solid.sum()
        onto += (solid * np.maximum(away[:, 1] / distance, 0)).sum()
    assert sphere == pytest.approx(4 * np.pi, rel=1e-3)
    assert onto == pytest.approx(np.pi, rel=1e-3)
    assert names_near("Wall003") == ()


def test_a_small_target_has_its_panels_at_a_distance() -> None:
    one = light_around("Panel000", CENTRE, 0.05, COUNT)
    assert light_towards(one, CENTRE)[1] == pytest.approx(LEAST_M)


def test_directions_are_unit_and_even() -> None:
    """Each light has its nearest neighbour at the same distance, about; together they favour no side."""
    found = directions(200)
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.ones(200))
    assert np.abs(found.mean(0)).max() < 0.01
    cosines = found @ found.T - 2 * np.eye(200)
    nearest = np.arccos(cosines.max(1))
    assert nearest.max() / nearest.min() < 1.6


def test_lights_near_one_are_near_it() -> None:
    """Nearer than its neighbours are, in a ring around it."""
    for name in ("Panel011", "Sun011"):
        own = light_towards(light(name), CENTRE)[0]
        ring = [light_towards(light(each), CENTRE)[0] for each in names_near(name)[:6]]
        angles = np.arccos([own @ each for each in ring])
        others = np.delete(directions(COUNT), 11, axis=0) @ own
        assert np.ptp(angles) < 1e-9
        assert 0 < angles[0] < np.arccos(others.max())
        assert np.linalg.norm(np.mean(ring, axis=0)) == pytest.approx(np.cos(angles[0]))
    assert len(names_near("Sun011")) == 6
    assert len(names_near("Panel011")) == 8


@pytest.mark.parametrize("towards", [(1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (0.6, 0.64, -0.48)])
def test_facing_is_a_rotation_that_looks_back(towards) -> None:
    found = facing(np.array(towards, float))
    assert found.T @ found == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(found) == pytest.approx(1)
    assert -found[:, 2] == pytest.approx(-np.array(towards))


def test_strength_is_linear_and_nothing_else_changes() -> None:
    dome = DomeLight(
        path="dome", T_cam_dome=Transform(to="cam", of="dome", rotation=np.eye(3), translation=np.zeros(3)),
        radiance=(1, 2, 3),
    )  # fmt: skip
    assert getattr(scaled(dome, 2.0), "radiance", None) == (2, 4, 6)
    assert getattr(scaled(light("Sun003"), 2.5), "irradiance", None) == (2.5, 2.5, 2.5)
    panel, twice = light("Panel003"), scaled(light("Panel003"), 2.0)
    assert isinstance(panel, RectLight)
    assert isinstance(twice, RectLight)
    assert irradiance(twice) == pytest.approx(2 * irradiance(panel))
    assert light_towards(dome, CENTRE)[1] == 0
