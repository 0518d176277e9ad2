"""Area lights: what they show of themselves, and by what they count in keys."""

import numpy as np
import pytest

from spin_usd.geometry.directions import sphere
from spin_usd.scene.content import key_of
from spin_usd.scene.light import CylinderLight, DiskLight, PointLight, RectLight, SphereLight
from tests.cases.scenes import pose

DIRECTIONS = 100_000
EVEN = 1e-4  # relative: what so many directions, spread evenly, miss of a mean
COMMON = {"path": "/L", "T_cam_light": pose(), "emission": (3.0, 2.0, 1.0)}
LIGHTS = [
    SphereLight(radius=0.3, **COMMON),
    DiskLight(radius_x=0.3, radius_y=0.2, **COMMON),
    RectLight(width=0.3, height=0.7, **COMMON),
    CylinderLight(length=0.4, radius=0.1, **COMMON),
]
EACH = pytest.mark.parametrize("light", LIGHTS, ids=lambda light: light.shape)


@EACH
def test_on_average_a_light_shows_a_quarter_of_its_surface(light) -> None:
    """Cauchy's theorem of a convex body's mean shadow; it holds for one side of a plate, and for a mantle, too."""
    assert light.projected_area(sphere(DIRECTIONS)).mean() == pytest.approx(light.area / 4, rel=EVEN)


@EACH
def test_a_light_shows_the_most_to_those_it_faces(light) -> None:
    shown = light.projected_area(np.concatenate([sphere(DIRECTIONS), [[0, 0, -1]]]))
    assert shown[-1] == shown.max() == pytest.approx(light.facing_area, rel=1e-15)


@EACH
def test_lengths_scale_its_surface_by_their_square(light) -> None:
    assert light.scaled(3.0).area == pytest.approx(9 * light.area, rel=1e-15)


def test_lights_of_other_shapes_or_sizes_have_other_keys() -> None:
    point, other = PointLight(**COMMON), SphereLight(radius=0.4, **COMMON)
    assert len({key_of(light) for light in (*LIGHTS, point, other)}) == len(LIGHTS) + 2
