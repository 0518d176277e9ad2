"""What beams meet, against Möller and Trumbore in double precision: exact ranges, first surfaces, any direction."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.errors import GeometryError
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.body import Body
from spin_usd.scene.derived.echoes import echoes, laser_range
from spin_usd.scene.lidar import Lidar, RangeFinder
from spin_usd.studio.record import recorded_lidar
from tests.authorities.first_hit import first_hit
from tests.cases.scenes import box, pose, scene, soup, target

FORWARD = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])  # the LiDAR's x, y, z are the camera's z, -x, -y
ROUNDING = 1e-12  # of ranges of metres: float64 rounds to 1e-16, a beam at a flat angle stretches that
DOUBT = 1e-4  # barycentric: what the ray caster's float32 may be off, and more


def mounted(rotation=FORWARD, position=(0.0, 0, 0)):
    return Transform(to="cam", of="lidar", rotation=np.array(rotation), translation=np.array(position))


def seen_by(made, lidar):
    return replace(made, lidar=lidar), echoes(replace(made, lidar=lidar), EmbreeCaster().first_faces)


def against_exact_rays(made, lidar, found):
    """The largest error of the ranges of sure beams; the others are few."""
    T_lidar_cam = lidar.T_cam_lidar.inverse()
    triangles = [
        T_lidar_cam.points(b.T_cam_body.points(b.target.mesh.points))[b.target.mesh.faces] for b in made.bodies
    ]
    expected = first_hit(lidar.directions, np.concatenate(triangles), doubt=DOUBT)
    ranges = np.full(lidar.beams, np.inf)
    ranges[found.beam] = found.range
    assert expected.sure.mean() > 0.9
    np.testing.assert_array_equal(np.isfinite(ranges)[expected.sure], (expected.face >= 0)[expected.sure])
    sure = expected.sure & (expected.face >= 0)
    return np.abs(ranges[sure] - expected.distance[sure]).max()


@pytest.mark.parametrize("pattern", ["raster", "spinning", "rosette"])
def test_ranges_are_those_of_exact_rays(pattern) -> None:
    points, faces, parts = soup(5, count=60)
    made = scene(target(points, faces, parts=parts), T_cam_body=pose((0.5, -0.3, 0.7, 0.2), (0.6, -0.4, 3)))
    lidar = Lidar(
        T_cam_lidar=mounted(position=(0.4, -0.2, 0.1)), pattern=pattern, rows=40, columns=50,
        azimuth_deg=(-40, 40), elevation_deg=(-40, 40),
    )  # fmt: skip
    made, found = seen_by(made, lidar)
    assert len(found.beam) > 300
    assert against_exact_rays(made, lidar, found) < ROUNDING
    assert ((found.cosine >= 0) & (found.cosine <= 1 + 1e-12)).all()


def test_a_lidar_within_the_target_sees_all_around() -> None:
    points, faces = box((-2, -2, -2), (2, 2, 2))
    lidar = Lidar(
        T_cam_lidar=mounted(position=(0.3, 0.2, 4.5)), pattern="spinning", rows=16, columns=90,
        azimuth_deg=(-180, 180), elevation_deg=(-89, 89),
    )  # fmt: skip
    made, found = seen_by(scene(target(points, faces)), lidar)
    assert len(found.beam) == lidar.beams
    assert against_exact_rays(made, lidar, found) < ROUNDING


def test_range_costs_only_its_own_rounding() -> None:
    points, faces = box()
    far = 1e6
    lidar = Lidar(T_cam_lidar=mounted(), rows=9, columns=9, azimuth_deg=(-2e-5, 2e-5), elevation_deg=(-2e-5, 2e-5))
    _, found = seen_by(scene(target(points, faces), T_cam_body=pose(t=(0, 0, far))), lidar)
    x = lidar.directions[found.beam, 0]
    np.testing.assert_allclose(found.range * x, far - 0.5, rtol=0, atol=1e-9)
    assert len(found.beam) == 81


def test_the_nearer_of_two_bodies_answers_with_its_own_ids() -> None:
    points, faces = box()
    near = Body(id=2, target=target(points, faces), T_cam_body=pose(t=(0.5, 0, 2)))
    arm = Body(id=0, target=target(*box((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))), T_cam_body=pose(t=(-0.2, 0, 1)))
    made = scene(target(points, faces), others=(near, arm))
    lidar = Lidar(T_cam_lidar=mounted(), rows=40, columns=40, azimuth_deg=(-25, 25), elevation_deg=(-25, 25))
    made, found = seen_by(made, lidar)
    assert against_exact_rays(made, lidar, found) < ROUNDING
    assert set(zip(found.target.tolist(), found.part.tolist(), strict=True)) == {(1, 1), (2, 2), (0, 3)}
    assert (np.diff(found.beam) > 0).all()


def test_a_scene_without_lidar_has_none() -> None:
    with pytest.raises(GeometryError, match="no LiDAR"):
        echoes(scene(target(*box())), EmbreeCaster().first_faces)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"rows": 0}, "0 rows and 128 columns are not 1 to"),
        ({"azimuth_deg": (10.0, -10.0)}, "azimuths are 10 to -10"),
        ({"azimuth_deg": (-89.0, 89.0)}, "expected some of -85 to 85"),
        ({"elevation_deg": (5.0, 5.0)}, "elevations are 5 to 5"),
        ({"range_limits": (5.0, 1.0)}, "expected the lesser first"),
        ({"noise_constant": -1.0}, "noise is -1 m"),
        ({"drop_out": 1.0}, "drop-out is 1"),
        ({"max_incidence_deg": 0.0}, "largest incidence is 0"),
        ({"pattern": "spiral"}, "expected raster or spinning or rosette"),
    ],
)
def test_a_lidar_that_cannot_be_is_refused(changed, words) -> None:
    with pytest.raises(GeometryError, match=words):
        Lidar(T_cam_lidar=mounted(), **changed)


def test_a_record_gives_the_lidar_back() -> None:
    lidar = Lidar(T_cam_lidar=mounted(position=(1, 2, 3)), pattern="spinning", noise_constant=0.25, drop_out=0.5)
    again = recorded_lidar(lidar).lidar
    assert recorded_lidar(again) == recorded_lidar(lidar)
    np.testing.assert_allclose(again.T_cam_lidar.matrix, lidar.T_cam_lidar.matrix, atol=1e-15)


def test_a_range_finder_measures_a_plate_as_geometry_says() -> None:
    """Along its axis the plane's distance; over the cone the mean of z sqrt(1 + r^2); half of it at an edge."""
    half_deg, away = 2.0, 5.0
    plate = target(np.array([[0, -9, 0], [9, -9, 0], [9, 9, 0], [0, 9, 0]], float), np.array([[0, 2, 1], [0, 3, 2]]))
    T_cam_finder = Transform(to="cam", of="cam", rotation=np.eye(3), translation=np.array([0.3, 0, 0]))
    finder = RangeFinder(T_cam_finder=T_cam_finder, divergence_deg=2 * half_deg)

    def measured(x):
        made = replace(scene(plate, T_cam_body=pose(t=(x, 0, away))), range_finder=finder)
        return laser_range(made, EmbreeCaster().first_faces)

    inside, edge, beside = measured(-1), measured(0.3), measured(9)
    square = np.tan(np.radians(half_deg)) ** 2
    assert inside.boresight == pytest.approx(away, abs=ROUNDING)
    assert (inside.target, inside.share) == (1, 1)
    assert inside.mean == pytest.approx(away * ((1 + square) ** 1.5 - 1) * 2 / 3 / square, rel=1e-6)
    assert edge.share == pytest.approx(0.5, abs=0.01)
    assert (beside.boresight, beside.nearest, beside.mean, beside.share, beside.target) == (None, None, None, 0, 0)
