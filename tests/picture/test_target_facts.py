"""The facts of targets against pictures of each body alone and in a larger frame."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import to_builtins

from spin_usd.geometry.camera import Camera
from spin_usd.labels.dense_pose import DENSE_POSE
from spin_usd.labels.depth import DEPTH
from spin_usd.labels.instance import INSTANCE
from spin_usd.labels.segmentation import SEGMENTATION
from spin_usd.picture.shown_bodies import shown_by_label, shown_by_rays
from spin_usd.picture.target_facts import target_facts
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.body import Body
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.studio.record import recorded_target
from tests.cases.scenes import SMALL, box, pose, scene, target

CASTER = EmbreeCaster()
CUBE = target(*box())


def recorded_of(s, facts):
    """What a record says of the targets of a scene."""
    return [to_builtins(recorded_target(body, each)) for body, each in zip(s.targets, facts, strict=True)]


def silhouette(s):
    """The pixels (H, W) that the target of a scene of one body covers."""
    pixels = np.zeros(s.camera.frame.shape, bool)
    pixels[s.region.slices] = CASTER.visibility(s).face >= 0
    return pixels


def around(pixels):
    """Tight box of True pixels."""
    rows, columns = np.nonzero(pixels)
    return [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]


def enlarged(camera, by):
    """The camera with a frame larger by so many pixels on every side."""
    return Camera(
        width=camera.width + 2 * by,
        height=camera.height + 2 * by,
        fx=camera.fx,
        fy=camera.fy,
        cx=camera.cx + by,
        cy=camera.cy + by,
        distortion=camera.distortion,
    )


def test_one_target_alone_hides_nothing_of_itself() -> None:
    s = scene(CUBE)
    (facts,) = target_facts(s, None, CASTER)
    pixels = silhouette(s)
    assert facts.counts.visible == facts.counts.amodal == pixels.sum()
    assert facts.counts.visible_fraction == 1
    assert facts.box_visible == around(pixels)
    assert facts.box_amodal is not None
    np.testing.assert_allclose(facts.box_amodal.ravel(), facts.box_visible, atol=0.5 + 1e-9)
    assert not facts.truncated


def test_labels_show_the_bodies_that_rays_meet() -> None:
    s = scene(CUBE)
    surface = visible_surface(s, CASTER.visibility(s))
    rays = shown_by_rays(s, CASTER)
    for label in (DEPTH, SEGMENTATION, DENSE_POSE):
        shown = shown_by_label(s, label.name, label.make(s, surface))
        assert np.array_equal(shown.ids, rays.ids)


@pytest.mark.parametrize("label", [DEPTH, SEGMENTATION, DENSE_POSE], ids=lambda label: label.name)
def test_labels_of_nothing_show_nothing(label) -> None:
    s = scene(CUBE, T_cam_body=pose(t=(0, 0, -4)))
    shown = shown_by_label(s, label.name, label.make(s, visible_surface(s, CASTER.visibility(s))))
    assert shown.ids.size == 0
    assert shown.box(1) is None


def test_labels_of_several_bodies_show_what_rays_meet() -> None:
    arm = Body(id=0, target=target(*box((-2, -0.1, -0.1), (2, 0.1, 0.1))), T_cam_body=pose(t=(0, 0.2, 2)))
    s = scene(CUBE, others=(Body(id=2, target=CUBE, T_cam_body=pose(t=(0.5, 0.3, 6))), arm))
    surface, rays = visible_surface(s, CASTER.visibility(s)), shown_by_rays(s, CASTER)
    assert np.array_equal(shown_by_label(s, "segmentation", SEGMENTATION.make(s, surface)).ids, rays.ids)
    by_instance = shown_by_label(s, "instance", INSTANCE.make(s, surface))
    assert np.array_equal(by_instance.ids, np.maximum(rays.ids, 0))
    assert shown_by_label(s, "depth", DEPTH.make(s, surface)) is None
    found, expected = (recorded_of(s, target_facts(s, shown, CASTER)) for shown in (by_instance, rays))
    assert found == expected


@pytest.mark.parametrize("x", [2.4, -2.5, 6.0])
def test_the_visible_fraction_counts_pixels_outside_the_frame(x) -> None:
    s = scene(CUBE, T_cam_body=pose((0.9, 0.2, 0.3, 0.1), (x, 0.3, 4.5)))
    (facts,) = target_facts(s, None, CASTER)
    whole = silhouette(replace(s, camera=enlarged(SMALL, 200)))
    assert whole.any()
    inside = whole[200:-200, 200:-200].sum()
    assert facts.counts.visible == facts.counts.amodal == inside
    assert facts.counts.visible_fraction == inside / whole.sum()
    assert facts.truncated


def test_a_target_far_larger_than_the_frame_is_sampled() -> None:
    s = scene(CUBE, T_cam_body=pose(t=(0, 0, 0.58)))
    camera = Camera(width=64, height=48, fx=70, fy=71, cx=31, cy=25)
    (facts,) = target_facts(replace(s, camera=camera), None, CASTER)
    side = 1 / 0.08  # the face before the camera hides all others
    assert facts.counts.visible_fraction == pytest.approx(64 * 48 / (side * 70 * side * 71), rel=1e-2)


def test_what_stands_before_a_target_hides_it() -> None:
    other = Body(id=2, target=CUBE, T_cam_body=pose((0.9, 0.1, 0.4, 0.2), (0.5, 0.3, 6)))
    arm = Body(id=0, target=target(*box((-2, -0.1, -0.1), (2, 0.1, 0.1))), T_cam_body=pose(t=(0, 0.2, 2)))
    s = scene(CUBE, others=(other, arm))
    shown = shown_by_rays(s, CASTER)
    first, second = target_facts(s, shown, CASTER)
    for facts, alone, body in ((first, s.one_body_scenes[0], 1), (second, s.one_body_scenes[1], 2)):
        pixels = silhouette(alone)
        assert facts.counts.amodal == pixels.sum()
        assert facts.counts.visible == (shown.ids == body).sum() < pixels.sum()
        assert facts.counts.visible_fraction == facts.counts.visible / pixels.sum()
        assert not facts.truncated
    assert (shown.ids == 0).any()


def test_nothing_is_known_of_a_target_that_is_not_seen() -> None:
    unseen = scene(CUBE, T_cam_body=pose(t=(0, 0, -4)))
    (found,) = recorded_of(unseen, target_facts(unseen, None, CASTER))
    assert found["pixels"] == {"visible": 0, "amodal": 0}
    assert found["visible_fraction"] is None
    assert found["box"] == {"visible": None, "amodal": None, "truncated": True}
    assert found["box_3d"]["corners"] == [None] * 8


def test_the_corners_of_the_box_go_from_least_to_greatest() -> None:
    s = scene(target(*box((-0.1, -0.2, -0.3), (0.4, 0.5, 0.6))))
    (facts,) = target_facts(s, None, CASTER)
    corners = [[x, y, z] for x in (-0.1, 0.4) for y in (-0.2, 0.5) for z in (-0.3, 0.6)]
    np.testing.assert_allclose(facts.corners, s.camera.project(s.T_cam_body.points(corners)), atol=1e-12)
