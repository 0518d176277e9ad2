"""What pictures show, against rays that Embree casts and laws of simple bodies."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import convert, to_builtins
from scipy.spatial.transform import Rotation

from spin_usd.geometry.directions import sphere
from spin_usd.geometry.facing import facing_share, few_axes
from spin_usd.geometry.triangles import normals
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface import geometric_normals, visible_surface
from spin_usd.scene.derived.view_text import sentences, size_text, summary
from spin_usd.scene.derived.views import ViewCollector, ViewKind, Views, lit_shares
from spin_usd.scene.light import DistantLight, PointLight
from spin_usd.scene.plausible import is_plausible, likely_units
from tests.cases import scenes

CAMERA = replace(scenes.SMALL, width=160, height=120, fx=140, fy=140, cx=80, cy=60, distortion=(0.0,) * 5)
SUN = DistantLight(path="/Sun", direction_cam=(0.0, 0.0, 1.0), irradiance=(1361.0,) * 3)  # behind the camera
HALF_CELL = 0.12  # of the share of a round body: its faces count together within 14 degrees
LIT, SHADED = 0.2, 0.1  # of what rays find lit, where a picture is said to be turned away, and where surely


def a_box():
    return scenes.target(*scenes.box((-0.5, -0.25, -0.1), (0.5, 0.25, 0.1)))


def ball(count=400):
    """A sphere of 1 m."""
    from scipy.spatial import ConvexHull

    points = sphere(count)
    return scenes.target(points, ConvexHull(points).simplices)


def seen(*places, target=None, lights=(SUN,), camera=CAMERA):
    """The views of pictures "0", "1", ... with the target at these places."""
    collector = ViewCollector()
    for i, place in enumerate(places):
        pose = scenes.pose(t=place)
        collector.add(scenes.scene(target or a_box(), camera=camera, T_cam_body=pose, lights=lights, name=str(i)))
    return collector.views()


def test_sizes_and_distances_are_those_of_the_bounding_box() -> None:
    found = seen((0, 0, 5), (0, 3, 4), (0, 0, 7))
    assert found.size == (1.0, 0.5, 0.2)
    assert found.distance == (5.0, 7.0)
    assert found.pixels[1] == pytest.approx(2 * np.sqrt(0.3225) * 140 / 5)
    assert summary(found).startswith("target 1 x 0.5 x 0.2 m, 5 to 7 m from the camera, its diagonal ")
    in_turn = summary(found, [0.4, 1.0, 0.35])
    assert in_turn.startswith("3 craft of 0.35 to 1 m, 5 to 7 m from the camera, their diagonals ")


def test_a_ball_is_as_large_as_it_was_made() -> None:
    assert seen((0, 0, 9), target=ball()).size == pytest.approx((2, 2, 2), rel=0.01)


def test_each_picture_is_of_its_kind() -> None:
    found = seen((0, 0, 5), (0, 0, -8), (8, 0, 5), (2.9, 0, 5), (0.1, 0, 0.05), (0, 0, 8000))
    kinds = {kind: each.names for kind, each in found.of.items() if kind is not ViewKind.SMALL}
    assert kinds == {
        ViewKind.BEHIND: ("1",),
        ViewKind.OUTSIDE: ("2",),
        ViewKind.CUT_OFF: ("3",),
        ViewKind.CAMERA_INSIDE: ("4",),
        ViewKind.FEW_PIXELS: ("5",),
    }
    assert found.pictures == 6
    assert "in 1 of 6 pictures the target is behind the camera (1)" in " ".join(sentences(found))


def test_views_come_back_from_json() -> None:
    import json

    found = seen((0, 0, 5), (0, 0, -8))
    assert convert(json.loads(json.dumps(to_builtins(found))), Views) == found


def test_a_side_that_faces_away_from_the_sun_is_told_and_no_light_at_all_apart() -> None:
    from_behind = replace(SUN, direction_cam=(0.0, 0.0, -1.0))
    assert seen((0, 0, 5)).count(ViewKind.UNLIT, ViewKind.DARK) == 0
    assert seen((0, 0, 5), lights=(from_behind,)).count(ViewKind.UNLIT) == 1
    assert seen((0, 0, 5), lights=(from_behind, SUN)).count(ViewKind.UNLIT, ViewKind.DARK) == 0
    assert seen((0, 0, 5), lights=()).count(ViewKind.DARK) == 1
    assert seen((0, 0, 5), lights=(replace(SUN, obscuration=1.0),)).count(ViewKind.DARK) == 1
    lamp = PointLight(path="/L", T_cam_light=scenes.pose(), emission=(1.0,) * 3)
    assert seen((0, 0, 5), lights=(from_behind, lamp)).count(ViewKind.UNLIT, ViewKind.DARK) == 0


@pytest.mark.parametrize("angle", [0, 40, 90, 140, 180])
def test_of_a_ball_the_lit_share_is_that_of_the_moon(angle) -> None:
    """(1 + cos) / 2 of the angle between camera and Sun."""
    axes = ball().mesh.face_axes
    to_light = np.array([np.sin(np.radians(angle)), 0, np.cos(np.radians(angle))])
    found = facing_share(axes, np.array([[0, 0, 1.0]]), to_light[None])[0]
    assert found == pytest.approx((1 + np.cos(np.radians(angle))) / 2, abs=HALF_CELL)


def test_the_few_axes_of_a_body_stand_for_all_its_faces() -> None:
    target = ball(3000)
    corners = target.mesh.points[target.mesh.faces]
    few = target.mesh.face_axes
    assert len(few) < len(corners) / 10
    upright = normals(corners)
    upright *= np.where(np.take_along_axis(upright, np.abs(upright).argmax(1)[:, None], 1) < 0, -1, 1)
    assert few.sum(0) == pytest.approx(upright.sum(0))


def test_a_mesh_in_places_has_the_axes_of_its_copies() -> None:
    from spin_usd.scene.instances import Instances

    target = a_box()
    turn = Rotation.from_euler("xyz", (0.4, 0.3, -0.2)).as_matrix() * (1, -2, 0.5)
    matrices = np.array([np.hstack([turn, [[1], [2], [3]]]), np.eye(3, 4)])
    placed = Instances(shape=target.mesh, matrices=matrices, parts=np.ones((2, 2)), groups=np.zeros(2))
    corners = target.mesh.points[target.mesh.faces]
    copies = np.concatenate([normals(corners @ matrix[:, :3].T) for matrix in matrices])
    moved = placed.area_vectors(normals(corners))
    assert np.abs(moved) == pytest.approx(np.abs(copies))  # a mirror turns them over


def test_which_way_corners_go_round_does_not_matter() -> None:
    points, faces = scenes.box()
    directions = sphere(20)
    shares = [
        facing_share(few_axes(normals(points[some])), directions, directions[::-1])
        for some in (faces, faces[:, ::-1], np.where(np.arange(12)[:, None] % 2, faces, faces[:, ::-1]))
    ]
    assert np.array_equal(shares[0], shares[1])
    assert np.array_equal(shares[0], shares[2])


def test_pictures_said_to_be_unlit_are_those_whose_rays_to_the_sun_are_shadowed() -> None:
    """Two boxes in front of a plate, which shade one another: what is said is of their faces alone, so of pictures that
    show much light none is told, and of those without any nearly all are."""
    target, caster, rng = scenes.target(*scenes.boxes()), EmbreeCaster(), np.random.default_rng(3)
    told, lit = [], []
    for rotation in Rotation.random(150, random_state=rng).as_matrix():
        pose = replace(scenes.pose(t=(0, 0, 8)), rotation=rotation)
        to_light = rng.normal(size=3)
        to_light /= np.linalg.norm(to_light)
        scene = scenes.scene(target, camera=CAMERA, T_cam_body=pose)
        suns = (tuple(to_light.tolist()),)
        told.append(lit_shares(target.mesh.face_axes, pose.points(target.mesh.centre)[None], rotation[None], [suns])[0])
        lit.append(cast_share(caster, scene, rotation.T @ to_light))
    dark, rendered = np.array(told) < 0.1, np.array(lit)
    assert 10 < dark.sum() < 100
    assert (rendered[dark] < LIT).all()
    assert dark[rendered < SHADED / 10].mean() > 0.8


def cast_share(caster, scene, to_light):
    """Of the pixels that show the target, the share whose surface faces `to_light` (3,), body axes, unshaded."""
    surface = visible_surface(scene, caster.visibility(scene))
    normal = geometric_normals(scene, surface.face)
    facing = np.flatnonzero(normal @ to_light > 0)
    lifted = (surface.body + 1e-5 * normal)[facing]
    return np.count_nonzero(~caster.shadowed(scene.target, lifted, to_light)) / len(surface.z)


@pytest.mark.parametrize(
    ("size", "units", "likely"),
    [
        (110, 1, [100, 1000, 39.37007874]),
        (1100, 1, [1000]),
        (0.0011, 1000, [1, 3.280839895, 10, 39.37007874]),
        (0.011, 100, [1, 3.280839895, 10, 39.37007874]),
        (3937, 1, [1000]),
        (1e-9, 1, []),
    ],
)
def test_likely_units_are_those_that_fit_the_usual_ones_first(size, units, likely) -> None:
    def fits(scale):
        return size * scale < 10

    assert likely_units(np.array([size, 0, 0]), units, fits) == likely


def test_plausible_sizes_are_those_of_crafts() -> None:
    assert [is_plausible((0, edge, 0)) for edge in (0.019, 0.02, 109, 200, 201)] == [False, True, True, True, False]


def test_sizes_are_written_without_exponents() -> None:
    assert size_text((1113.88, 0.75, 0.00031)) == "1110 x 0.75 x 0.00031 m"
