"""Attitudes have the distributions that their names say."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import kstest, uniform

from spin_usd.errors import InputError
from spin_usd.sampling.attitudes import Attitudes, AttitudesAround, Facing
from spin_usd.sampling.sample import stream

SURE = 1e-3  # of a test of the right distribution, the seed being what it is
COUNT = 2000


def sampled(law):
    return Rotation.from_quat([law.sample(stream(3, str(i))) for i in range(COUNT)], scalar_first=True)


def test_any_rotation_has_an_angle_of_its_law() -> None:
    angles = sampled(Attitudes()).magnitude()
    assert kstest(angles, lambda x: (x - np.sin(x)) / np.pi).pvalue > SURE


@pytest.mark.parametrize("most", [2.0, 40.0, 180.0])
def test_rotations_around_one_are_uniform_within_their_angle(most) -> None:
    centre = (0.5, 0.5, -0.5, 0.5)
    away = sampled(AttitudesAround(around=centre, most=most)) * Rotation.from_quat(centre, scalar_first=True).inv()
    whole, angles = np.radians(most), away.magnitude()
    assert angles.max() <= whole + 1e-8
    assert kstest(angles, lambda x: (x - np.sin(x)) / (whole - np.sin(whole))).pvalue > SURE
    axes = away.as_rotvec() / angles[:, None]
    assert kstest(axes[:, 2], uniform(-1, 2).cdf).pvalue > SURE


def test_a_face_is_turned_to_the_camera_and_about_it() -> None:
    turned = sampled(Facing(axis=(0, 3, 0), most=30.0))
    faced = turned.apply([0, 1, 0])
    cosines = -faced[:, 2]
    assert kstest(cosines, uniform(np.cos(np.radians(30)), 1 - np.cos(np.radians(30))).cdf).pvalue > SURE
    across = turned.apply([1, 0, 0])
    assert kstest(np.arctan2(across[:, 1], across[:, 0]), uniform(-np.pi, 2 * np.pi).cdf).pvalue > SURE


def test_a_face_can_be_turned_away() -> None:
    faced = sampled(Facing(axis=(0, 0, 1), towards=(0, 0, -1), least=180.0, most=180.0)).apply([0, 0, 1])
    assert faced == pytest.approx(np.tile([0, 0, 1.0], (COUNT, 1)), abs=1e-8)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: AttitudesAround(around=(1, 1, 0, 0), most=3), "no rotation"),
        (lambda: AttitudesAround(around=(1, 0, 0, 0), most=200), "200 degrees"),
        (lambda: Facing(axis=(0, 0, 0), most=3), "no direction"),
        (lambda: Facing(axis=(0, 0, 1), least=9, most=3), "no direction"),
    ],
)
def test_what_is_no_distribution_is_said(make, word) -> None:
    with pytest.raises(InputError, match=word):
        make()
