"""Labels of several bodies: each pixel shows the nearest, as Embree alone finds it, and says whose it is."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from spin_usd.labels.instance import faults
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.renderers.embree.caster import EmbreeCaster
from tests.cases.bodies import moved, three_bodies, without
from tests.cases.labelled import labels_of, picture_of
from tests.cases.scenes import BARREL, box, pose, target

EDGE_PIXELS = 2  # a ray along an edge may pass on either side of it
REPROJECTION_PX = 1e-3  # float32 points of a metre's size


@pytest.fixture(scope="module")
def scene():
    return three_bodies(BARREL)


@pytest.fixture(scope="module")
def labels(scene):
    return labels_of(scene)


def test_each_pixel_shows_the_nearest_body_that_its_ray_meets(scene, labels) -> None:
    """All bodies as one mesh in camera axes, met by Embree along OpenCV's rays."""
    height, width = labels["instance"].shape
    v, u = np.mgrid[:height, :width] + 0.5
    k, distortion = scene.camera.matrix, np.array(scene.camera.distortion)
    stop = (cv2.TERM_CRITERIA_COUNT, 200, 0)
    xy = cv2.undistortPoints(np.stack([u, v], -1).reshape(-1, 1, 2), k, distortion, criteria=stop)
    rays = np.concatenate([xy[:, 0], np.ones((len(xy), 1))], 1)
    each = [trimesh.Trimesh(b.T_cam_body.points(b.target.mesh.points), b.target.mesh.faces) for b in scene.bodies]
    first = np.cumsum([0, *(len(mesh.faces) for mesh in each)])[1:]
    caster = RayMeshIntersector(trimesh.util.concatenate(each))
    face = caster.intersects_first(np.zeros_like(rays), rays).reshape(height, width)
    ids = np.array([body.id for body in scene.bodies])[np.searchsorted(first, np.maximum(face, 0), side="right")]
    expected = np.where(face >= 0, ids, 0)
    assert (labels["instance"] != expected).sum() <= EDGE_PIXELS
    assert ((labels["depth"] > 0) != (face >= 0)).sum() <= EDGE_PIXELS
    assert {0, 1, 2} == set(np.unique(expected))


def test_dense_pose_is_of_the_target_seen_in_its_own_axes(scene, labels) -> None:
    centres = np.stack(np.nonzero(labels["instance"])[::-1], -1) + 0.5
    ids, points = labels["instance"][labels["instance"] > 0], labels["dense_pose"][labels["instance"] > 0]
    for body in scene.targets:
        own = ids == body.id
        uv = scene.camera.project(body.T_cam_body.points(points[own]))
        assert own.sum() > 500
        assert np.abs(uv - centres[own]).max() < REPROJECTION_PX
    assert not labels["dense_pose"][labels["instance"] == 0].any()
    assert set(np.unique(labels["segmentation"])) == {0, 1, 2, 3, 4}  # parts of the second count on from the first's


def test_labels_beside_an_occluder_are_those_without_it(scene, labels) -> None:
    alone = labels_of(without(scene, 2))
    beside = labels["segmentation"] != 4  # the arm's only part
    for name, array in alone.items():
        np.testing.assert_array_equal(array[beside], labels[name][beside])
    assert (alone["instance"][~beside] > 0).any()


def test_what_each_body_shows_alone_is_known(scene) -> None:
    found = EmbreeCaster().visibility(scene)
    for one, visibility in zip(scene.one_body_scenes, found.of_each_body, strict=True):
        np.testing.assert_array_equal(visibility.face, EmbreeCaster().visibility(one).face)
    assert sum((each.face >= 0).sum() for each in found.of_each_body) > (found.face >= 0).sum() > 0


def test_a_body_far_away_and_one_close_by_are_both_exact(scene) -> None:
    """1,000 km apart, which float32 resolves to 0.1 m; the far one is a station of 200 km."""
    station = replace(scene.bodies[1], target=target(*box((-1e5,) * 3, (1e5,) * 3)))
    far = moved(
        replace(scene, bodies=(scene.bodies[0], station, *scene.bodies[2:])),
        1,
        pose((0.7, -0.2, 0.5, 0.1), (3e5, 1e5, 1e6)),
    )
    labels, near = labels_of(far), labels_of(without(far, 1))
    first = labels["instance"] == 1
    assert first.sum() > 1000
    assert (labels["instance"] == 2).sum() > 1000
    assert not list(PIXEL_LABELS["depth"].faults(picture_of(far, labels)))
    for name in ("depth", "dense_pose", "segmentation"):
        np.testing.assert_array_equal(near[name][first], labels[name][first])


def test_an_instance_that_the_segmentation_contradicts_is_found(scene, labels) -> None:
    good = picture_of(scene, labels)
    assert not list(faults(good))
    swapped = np.where(labels["instance"] == 1, 2, labels["instance"]).astype(np.uint16)
    (fault,) = faults(picture_of(scene, labels, instance=swapped))
    assert fault.message.startswith("instance and segmentation name different targets in")


def test_every_label_of_several_bodies_agrees_with_the_others(scene, labels) -> None:
    assert [fault for label in PIXEL_LABELS.values() for fault in label.faults(picture_of(scene, labels))] == []
