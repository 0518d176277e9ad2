"""The states of keypoints against a ray test in double precision, with two bodies."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from spin_usd.picture.keypoint_states import SKIN, keypoint_states
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.body import Body
from tests.authorities.first_hit import first_hit
from tests.cases.scenes import FOLDING, SMALL, box, pose, scene, soup, target

CASTER = EmbreeCaster()
DOUBT = 1e-5  # where a surface is so near, rounding may decide
CENTRE, CORNER = (0, 0, 0), (0.5, 0.5, 0.5)


def with_keypoints(keypoints, points, faces, **fields):
    names = tuple(f"k{i}" for i in range(len(keypoints)))
    return replace(target(points, faces, **fields), keypoint_names=names, keypoints=np.array(keypoints, float))


def states_of(s, own=0):
    uv, states = keypoint_states(s.one_body_scenes, own, CASTER)
    return uv, [str(state) for state in states]


def expected(s, own):
    """The state of each keypoint by the authority; None where rounding may decide."""
    triangles = [body.T_cam_body.points(body.target.mesh.points)[body.target.mesh.faces] for body in s.bodies]
    points = s.bodies[own].T_cam_body.points(s.bodies[own].target.keypoints)
    skin = SKIN * s.bodies[own].target.mesh.size.max() / np.linalg.norm(points, axis=1)
    for point, own_skin in zip(points, skin, strict=True):
        if point[2] <= 0:
            yield "behind"
            continue
        uv = s.camera.project(point)
        if not ((uv >= 0) & (uv < (s.camera.width, s.camera.height))).all():
            yield "outside"
            continue
        hits = [first_hit(point[None], each, doubt=DOUBT) for each in triangles]
        ends = np.array([1 - own_skin if i == own else 1 for i in range(len(triangles))])
        distance = np.array([hit.distance[0] for hit in hits])
        sure = all(hit.sure[0] for hit in hits) and (np.abs(distance - ends) > DOUBT).all()
        hiding = np.where(distance < ends, distance, np.inf)
        state = "visible" if np.isinf(hiding).all() else "self-occluded" if hiding.argmin() == own else "occluded"
        yield state if sure else None


def two_bodies(seed):
    """Two soups of triangles, one often before the other, with keypoints on their surfaces and within."""
    rng = np.random.default_rng(seed)
    bodies = []
    for number in (1, 2):
        points, faces, parts = soup(2 * seed + number, count=12, size=0.8)
        on = rng.dirichlet((1, 1, 1), 6)[:, None] @ points[faces[:6]]
        keypoints = np.concatenate([on[:, 0], rng.uniform(-1, 1, (4, 3))])
        shape = with_keypoints(keypoints, points, faces, parts=parts)
        place = pose(rng.normal(size=4), t=(*rng.uniform(-1.2, 1.2, 2), rng.uniform(-1, 6)))
        bodies.append(Body(id=number, target=shape, T_cam_body=place))
    first, second = bodies
    return scene(first.target, camera=SMALL, T_cam_body=first.T_cam_body, others=(second,))


def test_they_are_those_of_a_ray_test_in_double_precision_with_two_bodies() -> None:
    counts: Counter[str | None] = Counter()
    for seed in range(60):
        s = two_bodies(seed)
        for own in (0, 1):
            _, states = states_of(s, own)
            for found, wanted in zip(states, expected(s, own), strict=True):
                assert wanted in (None, found)
                counts[wanted] += 1
    assert counts[None] < 0.02 * counts.total()
    assert all(counts[state] > 20 for state in ("visible", "self-occluded", "occluded", "outside", "behind"))


@pytest.mark.parametrize(
    ("depth", "state"), [(-1e-3, "visible"), (0, "visible"), (4e-3, "visible"), (6e-3, "self-occluded")]
)
def test_a_keypoint_a_little_below_its_surface_is_visible(depth, state) -> None:
    shape = with_keypoints([(0.1, 0.2, -0.5 + depth)], *box())
    assert states_of(scene(shape))[1] == [state]


def test_the_corners_of_a_box_and_its_centre() -> None:
    corners, faces = box()
    s = scene(with_keypoints([*corners, CENTRE], corners, faces), T_cam_body=pose((0.9, 0.2, 0.3, 0.1), (0, 0, 4)))
    distance = np.linalg.norm(s.T_cam_body.points(corners), axis=1)
    assert states_of(s)[1] == ["self-occluded" if d == distance.max() else "visible" for d in distance] + [
        "self-occluded"
    ]


def test_another_body_hides_however_near_it_is() -> None:
    shape, plate = with_keypoints([(0.1, 0.2, -0.5)], *box()), target(*box((-1, -1, -0.501), (1, 1, -0.5005)))
    s = scene(shape, others=(Body(id=0, target=plate, T_cam_body=pose()),))
    assert states_of(s)[1] == ["occluded"]


def test_pixels_are_given_wherever_the_lens_sees() -> None:
    shape = with_keypoints([CORNER, (0, 0, -6), (30, 0, 0), (2.2, 0, 0)], *box())
    uv, states = states_of(scene(shape, camera=FOLDING))
    assert states[1:] == ["behind", "outside", "outside"]
    assert np.isfinite(uv).all(1).tolist() == [True, False, False, True]


def test_a_target_without_keypoints_has_none() -> None:
    uv, states = states_of(scene(target(*box())))
    assert (uv.shape, states) == ((0, 2), [])
