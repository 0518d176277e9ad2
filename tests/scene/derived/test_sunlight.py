"""The Sun that a record holds."""

import numpy as np
import pytest

from spin_usd.scene.derived.sunlight import phase_angle, sunlight
from spin_usd.scene.light import DistantLight
from tests.cases.lit_scenes import BALL, DOME, SUN
from tests.cases.scenes import pose

TURNED = pose((0.5, -0.3, 0.7, 0.2), (1.6, -0.9, 3))


def test_it_is_the_brightest_distant_light_whatever_hides_it() -> None:
    fill = DistantLight(path="/Fill", direction_cam=(0, 0, 1), irradiance=(300.0, 300.0, 300.0))
    hidden = DistantLight(path="/Sun", direction_cam=(0, 0.6, 0.8), irradiance=(1361.0,) * 3, obscuration=1.0)
    found = sunlight((BALL, fill, hidden, DOME), TURNED)
    assert found.towards_cam.tolist() == [0, -0.6, -0.8]
    assert found.obscured == 1


def test_both_axes_tell_of_one_direction() -> None:
    found = sunlight((SUN,), TURNED)
    np.testing.assert_allclose(TURNED.directions(found.towards_body), found.towards_cam, atol=1e-15)
    assert np.linalg.norm(found.towards_body) == pytest.approx(1)


def test_without_one_there_is_none() -> None:
    dark = DistantLight(path="/Sun", direction_cam=(0, 0, 1), irradiance=(0.0, 0.0, 0.0))
    assert sunlight((BALL, DOME, dark), TURNED) is None


@pytest.mark.parametrize(("towards", "degrees"), [((0, 0, -1), 0), ((1, 0, 0), 90), ((0, 0, 1), 180)])
def test_behind_the_camera_is_full_light(towards, degrees) -> None:
    assert phase_angle(np.array(towards), np.array([0, 0, 8.0])) == pytest.approx(degrees)
