"""The record of a picture, made by its worker once the picture's files are written."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from spin_usd.commands.render.worker_options import WorkerOptions
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.labels.lit import LIT
from spin_usd.labels.table import CLOUD_LABELS
from spin_usd.picture.make_picture import RENDERED, Stopwatch
from spin_usd.picture.shown_bodies import ShownBodies
from spin_usd.picture.target_facts import TargetFacts
from spin_usd.scene.body import Body
from spin_usd.scene.derived.content_keys import picture_seed, render_seed
from spin_usd.scene.model import Scene
from spin_usd.scene.photometry.sunlight import Sunlight, sunlight

OF_THE_SUN = RENDERED | {LIT.name}
"""The kinds of file that depend on where the Sun is."""


@dataclass(kw_only=True)
class CurrentPicture:
    """A picture while it is made.

    kinds: of file · keys: of its content · watch: the time that it takes · keep_render, keep_labels: whether the cache
    keeps them for others · passes: which were made for it, and which are shared · shown: the bodies that its labels
    show, where they say so · facts, notes, tones: what its record must say of its targets, of how it was made, and of
    the target's brightness.
    """

    scene: Scene
    kinds: Sequence[str]
    keys: Mapping[str, str]
    watch: Stopwatch
    keep_render: bool = True
    keep_labels: bool = True
    passes: dict[str, str] = field(default_factory=dict)
    shown: ShownBodies | None = None
    facts: Sequence[TargetFacts] = ()
    notes: dict[str, float] = field(default_factory=dict)
    tones: dict[str, Any] | None = None


def make_record(
    stage: Mapping[str, Any],
    picture: CurrentPicture,
    options: WorkerOptions,
    files: dict[str, Any],
    versions: dict[str, str],
) -> dict[str, Any]:
    """Return the picture's record, by schema record-1. `stage`: what in_child.stage_provenance says of it."""
    scene = picture.scene
    of_the_sun = files.keys() & OF_THE_SUN  # other labels stay when it moves
    sun = sunlight(scene.lights, scene.T_cam_body) if of_the_sun else None
    return {
        "schema": "record-1",
        "frame": scene.frame.name,
        "index": scene.frame.index,
        "variant": scene.frame.variant,
        **({"source_file": scene.frame.source_file} if scene.frame.source_file else {}),
        "camera": recorded_camera(scene.camera),
        "pose": recorded_pose(scene.T_cam_body),
        "targets": [recorded_target(body, facts) for body, facts in zip(scene.targets, picture.facts, strict=True)],
        **({"sun": recorded_sun(sun)} if sun else {}),
        **({"next": recorded_next(scene.next_frame)} if scene.next_frame else {}),
        **({"tones": picture.tones} if picture.tones else {}),
        **({"lidar": scene.lidar.as_json()} if scene.lidar and files.keys() & CLOUD_LABELS.keys() else {}),
        "files": files,
        "provenance": {
            "stage": {"root": options.stage, **stage},
            "keys": {name: key for name, key in picture.keys.items() if key},
            **_recorded_settings(scene, options),
            **({"options": dict(options.options)} if options.options else {}),
            "versions": versions,
            **picture.notes,
        },
    }


def _recorded_settings(scene: Scene, options: WorkerOptions) -> dict[str, Any]:
    """Return what the record says of how the picture was rendered, when, and from which seeds."""
    settings, region = options.settings, scene.picture_region
    return {
        "render": {
            "renderer": settings.renderer,
            "device": settings.device,
            "effort": asdict(settings.effort),
            "region": [region.x0, region.y0, region.x1, region.y1],
            **({"chosen": options.chosen.recorded} if options.chosen else {}),
        },
        "time_code": scene.frame.time_code,
        "seed": {
            "dataset": settings.seed,
            "render": render_seed(scene, settings),
            "picture": picture_seed(scene, settings),
        },
    }


def recorded_camera(camera: Camera) -> dict[str, Any]:
    """Return what the record says of a camera."""
    return {
        "width": camera.width,
        "height": camera.height,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "distortion": list(camera.distortion),
    }


def recorded_target(body: Body, facts: TargetFacts) -> dict[str, Any]:
    """Return what the record says of a target."""
    return {
        "id": body.id,
        "name": body.target.name,
        "pose": recorded_pose(body.T_cam_body),
        "range": float(np.linalg.norm(body.T_cam_body.translation)),
        **facts.as_json(),
    }


def recorded_pose(T_cam_body: Transform) -> dict[str, Any]:
    """Return what the record says of a pose."""
    return {"q_cam_body": T_cam_body.quaternion.tolist(), "t_cam_body": T_cam_body.translation.tolist()}


def recorded_next(following: Scene) -> dict[str, Any]:
    """Return what the record says of the next frame."""
    return {
        "frame": following.frame.name,
        "camera": recorded_camera(following.camera),
        "targets": [{"id": body.id, "pose": recorded_pose(body.T_cam_body)} for body in following.targets],
    }


def recorded_sun(sun: Sunlight) -> dict[str, Any]:
    """Return what the record says of the Sun."""
    return {
        "towards_cam": sun.towards_cam.tolist(),
        "towards_body": sun.towards_body.tolist(),
        "obscured": sun.obscured,
    }
