"""Scenes with all their labels, and what `check` sees of them."""

from dataclasses import replace

import numpy as np

from spin_usd.labels.labelled_picture import LabelledPicture, OtherView
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.part_classes import class_of_parts
from spin_usd.scene.derived.sunlight import sunlight
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.light import DistantLight
from tests.cases.scenes import with_first

CASTER = EmbreeCaster()


def sun(direction=(0.0, 0.0, 1.0), **fields):
    return DistantLight(path="/sun", direction_cam=direction, irradiance=(1.0, 1.0, 1.0), **fields)


def followed(scene, T_cam_body, *, camera=None, target=None):
    """`scene`, and after it a frame with that pose."""
    later = with_first(scene, T_cam_body=T_cam_body, target=target or scene.target)
    later = replace(later, camera=camera or scene.camera)
    return replace(scene, next_frame=later)


def surface_of(scene, label_pass=CASTER):
    return visible_surface(scene, label_pass.visibility(scene), CASTER)


def labels_of(scene, label_pass=CASTER):
    """All labels by name."""
    surface = surface_of(scene, label_pass)
    return {name: label.make(scene, surface) for name, label in PIXEL_LABELS.items()}


def _other_view(scene):
    return OtherView(camera=scene.camera, poses={b.id: b.T_cam_body for b in scene.targets}) if scene else None


def picture_of(scene, labels, **changed):
    """What `check` sees of the labels, some of them `changed`; those changed to None are not there."""
    arrays = {name: array for name, array in {**labels, **changed}.items() if array is not None}
    light = sunlight(scene.lights, scene.bodies[0].T_cam_body)
    parts = [body.id for body in scene.bodies for _ in body.target.parts]
    return LabelledPicture(
        camera=scene.camera,
        poses={body.id: body.T_cam_body for body in scene.targets},
        target_of_part=np.array([0, *parts], np.uint16),
        arrays=arrays,
        class_of_part=class_of_parts(scene),
        boxes={body.id: body.target.mesh.box for body in scene.targets},
        towards_sun=light.towards_cam if light else None,
        lidar=scene.lidar,
        next_frame=_other_view(scene.next_frame),
        paired=_other_view(scene.paired),
    )
