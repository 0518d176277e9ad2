"""Sets of a synthetic body whose true poses, boxes and keypoints are known, as readers would return them."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget
from spin_usd.audit.picture_measures import PictureMeasures, TargetMeasures
from spin_usd.audit.posed_targets import AuditedPicture, AuditedSet
from spin_usd.geometry.camera import Camera

CAMERA = Camera(width=640, height=480, fx=700.0, fy=700.0, cx=320.0, cy=240.0)
BODY = np.array([[0.9, 0.1, 0], [-0.8, 0.2, 0.1], [0, 0.5, -0.3], [0.1, -0.4, 0.6], [0.3, 0, 0.7], [-0.2, -0.3, -0.5]])
"""Six points without symmetry, metres."""


def synthetic(count=40, *, seed=0, keypoints=False, boxes=True, camera=CAMERA, matrices=False):
    """Return the pictures of random attitudes and places; every keypoint is in the frame and labelled."""
    rng = np.random.default_rng(seed)
    rotations = Rotation.random(count, random_state=rng)
    z = rng.uniform(4, 12, count)
    t = np.column_stack([rng.uniform(-0.25, 0.25, count) * z, rng.uniform(-0.15, 0.15, count) * z, z])
    pictures = []
    for place, (rotation, position) in enumerate(zip(rotations, t, strict=True)):
        pixels = camera.project(BODY @ rotation.as_matrix().T + position)
        numbers = rotation.as_matrix() if matrices else rotation.as_quat(scalar_first=True)
        target = AnnotatedTarget(
            id="target",
            rotation=numbers,
            t_cam_body=position,
            box=np.concatenate([pixels.min(0), pixels.max(0)]) if boxes else None,
            keypoints=np.column_stack([pixels, np.full(len(pixels), 2.0)]) if keypoints else None,
        )
        pictures.append(picture(f"img{place:03}.png", target, camera=camera))
    return pictures


def picture(name="img.png", *targets, camera=CAMERA, **labels):
    return AnnotatedPicture(name=name, exists=True, place=name, camera=camera, targets=targets, **labels)


def changed(pictures, change, *, every=1):
    """Return the pictures with `change` of the only target of every so-many-th."""
    return [
        each if place % every else replace(each, targets=(change(each.targets[0]),))
        for place, each in enumerate(pictures)
    ]


def audited(pictures, measures=None, **labels):
    """Return the set; measures: of each picture's files, or None where they were not read."""
    found = AnnotatedSet(pictures=pictures, **labels)
    known = measures or [None] * len(pictures)
    rows = [AuditedPicture(labels=each, measures=of) for each, of in zip(pictures, known, strict=True)]
    return AuditedSet(labels=found, pictures=rows)


def measured(name="img.png", *targets, **measures):
    """Return measures of a picture that is as its camera has it."""
    size = measures.pop("size", (CAMERA.width, CAMERA.height))
    return PictureMeasures(name=name, size=size, targets=list(targets) or [TargetMeasures()], **measures)
