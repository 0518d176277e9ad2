"""The record of a picture, made by its worker once the picture's files are written."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from msgspec import UNSET, UnsetType

from spin_usd.basics.arrays import Float
from spin_usd.labels.lit import LIT
from spin_usd.labels.table import CLOUD_LABELS
from spin_usd.picture.kinds import IMAGE, RENDERED
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.picture.shown_bodies import ShownBodies
from spin_usd.picture.target_facts import TargetFacts
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.records.record import (
    NextFrame,
    PairedCamera,
    PosedTarget,
    Provenance,
    Record,
    RecordedAppearance,
    RecordedBox,
    RecordedBox3d,
    RecordedCamera,
    RecordedFile,
    RecordedLidar,
    RecordedLight,
    RecordedMotion,
    RecordedPartShape,
    RecordedPixels,
    RecordedPose,
    RecordedRangeFinder,
    RecordedRender,
    RecordedRig,
    RecordedSeeds,
    RecordedShapedKeypoint,
    RecordedSun,
    RecordedTarget,
    RecordedTones,
    StageProvenance,
)
from spin_usd.renderers.background.sky import place_image
from spin_usd.scene.body import Body, BodyMotion
from spin_usd.scene.derived.content_keys import RenderSettings, background_seed, picture_seed, render_seed
from spin_usd.scene.derived.echoes import LaserRange
from spin_usd.scene.derived.sunlight import Sunlight, sunlight
from spin_usd.scene.keypoints import KeypointState
from spin_usd.scene.lidar import Lidar, RangeFinder
from spin_usd.scene.light import DistantLight, DomeLight, Light, PointLight
from spin_usd.scene.scene import Rig, Scene
from spin_usd.scene.target import ChangedPart, Target, TargetShape

OF_THE_SUN = RENDERED | {LIT.name}
"""The kinds of file that depend on the Sun's direction."""


@dataclass(kw_only=True)
class CurrentPicture:
    """A picture in the making."""

    scene: Scene
    kinds: Sequence[str]
    """Wanted kinds of file."""
    keys: Mapping[str, str]
    """Keys of its content, by name."""
    settings: RenderSettings
    watch: Stopwatch
    """Seconds that it takes, by kind of work."""
    keep_render: bool = True
    """Whether its sink stores the render for other pictures."""
    keep_labels: bool = True
    """Whether its sink stores the labels for other pictures."""
    recorded: bool = True
    """Whether the picture gets a record, for which facts, notes, tones and laser are made."""
    passes: dict[str, str] = field(default_factory=dict)
    """For "labels" and "render": "made" for it, or "shared" with others."""
    shown: ShownBodies | None = None
    """Bodies in its labels, if a label contains them."""
    facts: Sequence[TargetFacts] = ()
    notes: dict[str, float] = field(default_factory=dict)
    """Numbers on how it was made, by name."""
    tones: RecordedTones | None = None
    """Brightness of the target in the image."""
    laser: LaserRange | None = None
    """Distances that a laser range finder measures."""
    files: dict[str, RecordedFile] = field(default_factory=dict)
    """Entries of its files in the record."""


def make_record(
    stage: StageProvenance,
    picture: CurrentPicture,
    options: WorkerOptions,
    versions: dict[str, str],
) -> Record:
    """Return the record of a picture of that stage."""
    scene, files = picture.scene, picture.files
    sun = (
        sunlight(scene.lights, scene.bodies[0].T_cam_body) if files.keys() & OF_THE_SUN else None
    )  # others do not change with it
    measured = scene.lidar if files.keys() & CLOUD_LABELS.keys() else None
    return Record(
        frame=scene.frame.name,
        index=scene.frame.index,
        variant=scene.frame.variant,
        source_file=scene.frame.source_file or UNSET,
        time_s=UNSET if scene.frame.time_s is None else scene.frame.time_s,
        utc=scene.frame.utc or UNSET,
        camera=RecordedCamera.of(scene.camera),
        pose=RecordedPose.of(scene.bodies[0].T_cam_body),
        targets=[recorded_target(body, facts) for body, facts in zip(scene.targets, picture.facts, strict=True)],
        sun=recorded_sun(sun) if sun else UNSET,
        next=recorded_next(scene.next_frame) if scene.next_frame else UNSET,
        appearance=recorded_appearance(picture) if IMAGE in files else UNSET,
        rig=recorded_rig(scene.rig) if scene.rig else UNSET,
        paired=recorded_pair(scene.paired) if scene.paired else UNSET,
        tones=picture.tones or UNSET,
        range_finder=recorded_range(scene.range_finder, picture.laser) if scene.range_finder else UNSET,
        lidar=recorded_lidar(measured) if measured else UNSET,
        files=files,
        provenance=_provenance(stage, picture, options, versions),
    )


def _provenance(
    stage: StageProvenance, picture: CurrentPicture, options: WorkerOptions, versions: dict[str, str]
) -> Provenance:
    scene, settings, region = picture.scene, picture.settings, picture.scene.picture_region
    return Provenance(
        stage=stage,
        keys={name: key for name, key in picture.keys.items() if key},
        render=RecordedRender(
            renderer=settings.renderer,
            device=settings.device,
            effort=settings.effort,
            region=[region.x0, region.y0, region.x1, region.y1],
            chosen=options.chosen.recorded if options.chosen else UNSET,
        ),
        time_code=scene.frame.time_code,
        seed=RecordedSeeds(
            dataset=settings.seed, render=render_seed(scene, settings), picture=picture_seed(scene, settings)
        ),
        options=dict(options.options) or UNSET,
        versions=versions,
        auto_exposure=picture.notes.get("auto_exposure", UNSET),
    )


def recorded_appearance(picture: CurrentPicture) -> RecordedAppearance:
    """Return the record's facts on the image's exposure, noise and light."""
    scene, sensor = picture.scene, picture.scene.sensor
    plate, factor = scene.environment.back_plate, picture.notes.get("auto_exposure")
    placed = place_image(plate, background_seed(scene, picture.settings)) if plate else None
    same = ("exposure", "time", "iso", "gain", "full_well", "read_noise", "dark_current")
    return RecordedAppearance(
        **{name: float(getattr(sensor, name)) for name in same},
        exposure_chosen=UNSET if factor is None else sensor.exposure * factor,
        psf_sigma=scene.optics.psf_sigma,
        glare=scene.optics.glare,
        lights=[_recorded_light(light) for light in scene.lights],
        background=placed.image.name if placed else UNSET,
    )


def _recorded_light(light: Light) -> RecordedLight:
    if isinstance(light, DistantLight):
        return RecordedLight(path=light.path, strength=list(light.irradiance), unit="W/m2")
    if isinstance(light, DomeLight):
        return RecordedLight(path=light.path, strength=list(light.radiance), unit="W/m2/sr")
    return RecordedLight(
        path=light.path, strength=list(light.emission), unit="W/sr" if isinstance(light, PointLight) else "W/m2/sr"
    )


def recorded_target(body: Body, facts: TargetFacts) -> RecordedTarget:
    """Return the record's facts on a target."""
    shape = body.target.shape
    return RecordedTarget(
        id=body.id,
        name=body.target.name,
        pose=RecordedPose.of(body.T_cam_body),
        motion=_motion(body.motion),
        range=float(np.linalg.norm(body.T_cam_body.translation)),
        pixels=RecordedPixels(visible=facts.counts.visible, amodal=facts.counts.amodal),
        visible_fraction=facts.counts.visible_fraction,
        box=RecordedBox(
            visible=facts.box_visible,
            amodal=None if facts.box_amodal is None else facts.box_amodal.ravel().tolist(),
            truncated=facts.truncated,
        ),
        box_3d=RecordedBox3d(box=facts.box.tolist(), corners=[_pixel_or_null(uv) for uv in facts.corners]),
        keypoints=[_keypoint(uv, state) for uv, state in zip(facts.keypoints, facts.states, strict=True)],
        shape=[_part_shape(part) for part in shape.parts] if shape else UNSET,
        shaped_keypoints=list(_shaped_keypoints(body.target, shape)) if shape else UNSET,
    )


def _part_shape(part: ChangedPart) -> RecordedPartShape:
    return RecordedPartShape(
        name=part.name,
        path=part.path,
        T_body_drawn=part.T_body_drawn.tolist(),
        bend=part.bend_deg,
        bulge=part.bulge,
        missing=part.missing,
    )


def _shaped_keypoints(target: Target, shape: TargetShape) -> Iterator[RecordedShapedKeypoint]:
    points = zip(shape.keypoint_parts, shape.drawn_keypoints, target.keypoints, shape.keypoint_missing, strict=True)
    for part, drawn, true, missing in points:
        yield RecordedShapedKeypoint(part=part or None, drawn=drawn.tolist(), true=None if missing else true.tolist())


def _motion(motion: BodyMotion | None) -> RecordedMotion | UnsetType:
    if motion is None:
        return UNSET
    velocity, rate = motion.velocity.tolist(), motion.angular_velocity.tolist()
    return RecordedMotion(velocity=velocity, angular_velocity=rate)


def _pixel_or_null(uv: Float) -> list[float] | None:
    return uv.tolist() if np.isfinite(uv).all() else None


def _keypoint(uv: Float, state: KeypointState) -> tuple[float | None, float | None, KeypointState]:
    u, v = _pixel_or_null(uv) or (None, None)
    return u, v, state


def recorded_next(following: Scene) -> NextFrame:
    """Return the record's facts on the next frame."""
    return NextFrame(
        frame=following.frame.name,
        camera=RecordedCamera.of(following.camera),
        targets=posed_targets(following),
    )


def recorded_pair(paired: Scene) -> PairedCamera:
    """Return the record's facts on the camera that is paired with the picture's."""
    return PairedCamera(
        variant=paired.frame.variant, camera=RecordedCamera.of(paired.camera), targets=posed_targets(paired)
    )


def posed_targets(scene: Scene) -> list[PosedTarget]:
    """Return the record's places of the targets in another view."""
    return [PosedTarget(id=body.id, pose=RecordedPose.of(body.T_cam_body)) for body in scene.targets]


def recorded_rig(rig: Rig) -> RecordedRig:
    """Return the record's facts on the camera among several."""
    pose = rig.T_first_cam
    return RecordedRig(camera=rig.camera, q_first_cam=pose.quaternion.tolist(), t_first_cam=pose.translation.tolist())


def recorded_sun(sun: Sunlight) -> RecordedSun:
    """Return the record's facts on the Sun."""
    return RecordedSun(
        towards_cam=sun.towards_cam.tolist(), towards_body=sun.towards_body.tolist(), obscured=sun.obscured
    )


def recorded_range(finder: RangeFinder, met: LaserRange | None) -> RecordedRangeFinder:
    """Return the record's facts on a laser range finder that met `met`."""
    assert met, "called only for a scene that has one"
    return RecordedRangeFinder(
        origin=finder.T_cam_finder.translation.tolist(),
        direction=finder.T_cam_finder.rotation[:, 2].tolist(),
        divergence_deg=finder.divergence_deg,
        range=met.boresight,
        target=met.target,
        nearest=met.nearest,
        mean=met.mean,
        share=met.share,
    )


def recorded_lidar(lidar: Lidar) -> RecordedLidar:
    """Return the record's facts on a LiDAR: its fields, with T_cam_lidar as quaternion and translation."""
    rest = {field.name: getattr(lidar, field.name) for field in fields(lidar) if field.name != "T_cam_lidar"}
    pose = lidar.T_cam_lidar
    return RecordedLidar(q_cam_lidar=pose.quaternion.tolist(), t_cam_lidar=pose.translation.tolist(), **rest)
