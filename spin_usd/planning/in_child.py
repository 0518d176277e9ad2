"""Plan every picture that a run would make, with its keys, in child processes, for it opens the stage.

`open_plan` copies and describes the stage; `plan_pictures` does the long work, of some of the pictures in all variants,
so that several processes can share it. Pictures come as columns: there may be a million.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import convert, to_builtins

from spin_usd.arrays import Float
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.directions import half_sphere
from spin_usd.geometry.transform import Transform
from spin_usd.identity_memo import IdentityMemo
from spin_usd.labels.table import other_views, own_keys
from spin_usd.planning.columns import COLUMNS, PLANNING
from spin_usd.planning.opened_stage import OpenedStage, StageContent
from spin_usd.planning.skipped_work import SkippedWorkCounter
from spin_usd.planning.speed_trial import trial_seconds
from spin_usd.planning.work import features
from spin_usd.progress import Progress
from spin_usd.records.descriptions import PartEntry, TargetEntry
from spin_usd.renderers.device import DEVICES, needs_shader, shader_refusal
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.body import Body
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings, render_seed
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.derived.views import ViewCollector
from spin_usd.scene.effort import CPU
from spin_usd.scene.finding import in_sentences
from spin_usd.scene.model import NOMINAL, OneBody, Scene, augmentation_and_camera
from spin_usd.scene.sensor import Sensor
from spin_usd.scene.target import Part
from spin_usd.stage.author.target_root import origin_of
from spin_usd.stage.composition.copy_stage import copy_stage
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd import schema

PROGRESS_EVERY = 500
SIDES = 128  # directions looked from: some 13 degrees apart
SIDE_PX = 64  # of the square that is looked at
FAR = 100.0  # radii away, where lines of sight are all but parallel
SHARPNESS = 60  # power of the cosine by which the sides near a line of sight count; falls to half at 9 degrees
FAINTEST = 1e-3  # of the nearest side's weight: sides beyond some 27 degrees do not count, and change 0.03 %


class StagePlanner:
    """A stage that is opened to be planned, by `open_plan`, where it is given."""

    def __init__(self, **stage: Any) -> None:
        self._reader: StageReader | None = None
        self.opened: Any = None
        if stage:
            opened, self._reader = open_plan(**stage)
            self.opened = to_builtins(opened)

    def pictures(self, *, progress: Progress, **of: Any) -> list[dict[str, Any]]:
        """Plan some of its pictures, as plan_pictures; of the stage that it names where none is open yet."""
        return plan_pictures(progress=progress, opened=self._reader, **of)


def open_plan(
    *,
    stage: str,
    variants: Sequence[str],
    frames: str | None,
    seed: int | None,
    devices: Sequence[str] = (CPU,),
    renders: bool = True,
    copy_to: str | None = None,
    trial: bool = False,
) -> tuple[OpenedStage, StageReader]:
    """Return what a plan says of the stage as a whole; and the stage's reader, for `plan_pictures`.

    `variants`: names, and patterns with *, ? and [...]; empty means nominal alone, ["all"] all of them. `devices`:
    those that may render the light. `renders`: as plan_pictures has it.
    `copy_to`: first copy the stage into that folder and plan from the copy. `trial`: whether to try how fast this
    machine is.
    """
    root = copy_stage(Path(stage), Path(copy_to)) if copy_to else Path(stage)
    several = bool(variants)  # perhaps: then poses are kept for the readers after this one
    reader = StageReader(root, check_images=renders, keep_poses=several)
    chosen = range(len(reader.frames))[slice_of(frames)] if frames else range(len(reader.frames))
    if not chosen:
        found = f"frames {frames!r} selects none of the {len(reader.frames)} frames"
        raise InputError(found, where=stage, do="count from 0; 0:10 are the first ten")
    wanted = wanted_variants(variants, reader.variants)
    opened = OpenedStage(
        root=str(root),
        seed=reader.seed if seed is None else seed,
        variants=list(wanted),
        device=chosen_device(devices, _scenes(root, reader, wanted, chosen)),
        known_variants=list(reader.variants),
        names=[frame.name for frame in reader.frames],
        chosen=list(chosen),
        origin=origin_of(reader.stage),
        content=_stage_content(reader),
        trial_s=trial_seconds() if trial else None,
    )
    return opened, reader


def plan_pictures(
    *,
    root: str,
    variants: Sequence[str],
    chosen: Sequence[int],
    settings: Mapping[str, Any],
    image_suffix: str | None,
    labels: Sequence[str],
    provenance: Sequence[str],
    explain: bool,
    renders: bool = True,
    progress: Progress,
    opened: StageReader | None = None,
) -> list[dict[str, Any]]:
    """Return for each of the variants the pictures of the `chosen` frames, places in the stage, as columns, one entry
    a picture, and for those also named in `provenance` what a record says of the stage; "notes" are sentences on what
    is rendered otherwise than that. With `explain` also "skipped", as SkippedWorkCounter.taken has it. A column is None
    where it is that of the variant before.

    `settings`: RenderSettings as JSON. `image_suffix`: of the image files, None for none. `renders`: whether light is
    rendered; labels alone need no texture, and a damaged one is not refused. `labels`: those that are asked for.
    `progress` counts all of them. `opened`: a reader of the stage, in any variant. Raises UnsupportedError
    where image files cannot hold a sensor's numbers.
    """
    rendering = convert(settings, RenderSettings)
    counter = SkippedWorkCounter(rendering) if explain else None
    planner = _Planner(rendering, image_suffix, labels, counter, renders=renders, keep_poses=len(variants) > 1)
    answer = []
    before: dict[str, list[Any]] = {}
    reader = opened
    for number, variant in enumerate(variants):
        count = partial(_report, progress, number * len(chosen), len(variants) * len(chosen))
        if reader is None or reader.variant != variant:
            reader = StageReader(
                root, variant=variant, after=reader, check_images=renders, keep_poses=len(variants) > 1
            )
        views = ViewCollector(f"{variant}/" if len(variants) > 1 else "")
        planned = planner.columns(reader, chosen, views, count)
        stage = stage_provenance(reader) if variant in provenance else None
        skipped, notes = counter.taken() if counter else [], in_sentences(reader.notes)
        seen = views.views()
        said = {"skipped": skipped, "notes": notes, "views": to_builtins(seen)}
        columns = {name: None if column == before.get(name) else column for name, column in planned.items()}
        answer.append({"variant": variant, "stage": stage, **said, **columns})
        before = planned
    return answer


def _scenes(root: Path, reader: StageReader, variants: Sequence[str], chosen: range) -> Iterator[Scene]:
    """Yield the scenes of the chosen pictures of the variants."""
    for variant in variants:
        reader = StageReader(root, variant=variant, after=reader, check_images=False)
        for frame in reader.frames[chosen.start : chosen.stop : chosen.step]:
            yield reader.scene(frame)


def _report(progress: Progress, before: int, total: int, done: int) -> None:
    progress(PLANNING, before + done, total)


class Features:
    """The features of pictures that cost time, and how many groups their lights make."""

    def __init__(self) -> None:
        self._last = IdentityMemo[tuple[list[str], int]]()

    def of(self, scene: Scene) -> tuple[list[str], int]:
        """Return the names of work.features, and the number of light groups."""
        shapes = (body.target for body in scene.bodies)
        of = (scene.lights, scene.environment, scene.optics, scene.sensor, *shapes)
        return self._last.of(of, lambda: (features(scene), LightGroups.of(scene).count))


class Extents:
    """The extents that each picture's target covers; variants with the same geometry and sharpness share them."""

    def __init__(self) -> None:
        self._known: dict[str, list[int]] = {}
        self._coverage = Coverage()

    def of(self, scene: Scene, geometry: str) -> list[int]:
        """Return columns and rows x0, y0, x1, y1 of the picture of `scene`, whose geometry key is given, and about how
        many of its pixels show the target."""
        if not scene.blurred and geometry in self._known:
            return self._known[geometry]
        region, target = scene.picture_region, round(self._coverage.target_pixels(scene))
        found = [region.x0, region.y0, region.x1, region.y1, target]
        if not scene.blurred:
            self._known[geometry] = found
        return found


def stage_provenance(reader: StageReader) -> dict[str, Any]:
    """Return what a record says of the stage that made its picture, but its place."""
    return {"hash": reader.stage_hash, "files": reader.used_files, "variants": reader.variant_selections}


def wanted_variants(asked: Sequence[str], known: Sequence[str]) -> list[str]:
    """Return the `known` variants that the names and patterns `asked` choose, each once; for none asked the nominal
    one, as all cameras see it.

    Raises InputError for a name or pattern that chooses none.
    """
    if list(asked) == ["all"]:
        return list(known)
    found: list[str] = []
    for pattern in asked:
        matched = [variant for variant in known if fnmatchcase(variant, pattern)]
        if not matched:
            raise InputError(f"the stage has no variant {pattern!r}", do=f"choose among {', '.join(known)}, or all")
        found += matched
    nominal = [variant for variant in known if augmentation_and_camera(variant)[0] == NOMINAL]
    return list(dict.fromkeys(found)) or nominal


class _Planner:
    """Plans the pictures of one variant after the other; what is the same in several is worked out once."""

    def __init__(
        self,
        settings: RenderSettings,
        image_suffix: str | None,
        labels: Sequence[str],
        counter: SkippedWorkCounter | None,
        *,
        renders: bool,
        keep_poses: bool,
    ) -> None:
        self._lit = renders or counter is not None  # what costs time where light is rendered
        self._settings, self._image_suffix, self._labels, self._counter = settings, image_suffix, labels, counter
        self._keys = KeyMaker(settings, keep_poses=keep_poses)
        self._extents, self._features = Extents(), Features()
        self._checked: Sensor | None = None

    def columns(
        self, reader: StageReader, chosen: Sequence[int], views: ViewCollector, progress: Callable[[int], None]
    ) -> dict[str, list[Any]]:
        """Return the columns of a variant's pictures, by the names of COLUMNS; an `extent` is as Extents has it."""
        views_taken = other_views(self._labels)
        columns: dict[str, list[Any]] = {name: [] for name in COLUMNS}
        for done, frame in enumerate((reader.frames[place] for place in chosen), 1):
            scene = reader.scene(frame, views=views_taken)
            if self._image_suffix and scene.sensor is not self._checked:
                self._checked = scene.sensor
                _check_bit_depth(reader, scene, self._image_suffix)
            views.add(scene)
            for name, value in zip(COLUMNS, self._row(scene), strict=True):
                columns[name].append(value)
            if done % PROGRESS_EVERY == 0:
                progress(done)
        progress(len(chosen))
        return columns

    def _row(self, scene: Scene) -> tuple[Any, ...]:
        """Return the picture of `scene`, in the order of COLUMNS."""
        frame, keys = scene.frame, self._keys.keys(scene)
        extent = self._extents.of(scene, keys.geometry)
        has, groups = self._features.of(scene) if self._lit else ([], 0)
        if self._counter:
            self._counter.add(scene, keys.radiance, has)
        seed = render_seed(scene, self._settings) if scene.lidar else 0
        return (
            frame.index,
            frame.name,
            frame.time_code,
            keys.geometry,
            keys.radiance,
            keys.exposure,
            keys.targets,
            extent,
            groups,
            has,
            frame.source_file,
            own_keys(self._labels, scene, keys.geometry, seed),
        )


def _check_bit_depth(reader: StageReader, scene: Scene, image_suffix: str) -> None:
    """Raise UnsupportedError where image files of that kind cannot hold the sensor's numbers."""
    from spin_usd.formats.image_file import KINDS  # not above: it loads Pillow, which a plan of labels does not need

    bits = scene.sensor.bit_depth
    if f"uint{bits}" not in KINDS[image_suffix]:
        found = f"is {bits}, which {image_suffix} files cannot hold (picture {reader.variant}/{scene.frame.name})"
        do = "choose --image-format png, or make it 8"
        raise UnsupportedError(found, where=f"{reader.camera_path}.{schema.SENSOR['bit_depth']}", do=do)


def _stage_content(reader: StageReader) -> StageContent:
    """Return what dataset.json says of the bodies, and what a plan needs of the camera."""
    scene = reader.scene(reader.frames[0])
    return StageContent(
        targets=[described_target(body) for body in scene.targets],
        parts=dict(described_parts(reader.numbering.bodies)),
        bodies=len(reader.bodies),
        camera=[scene.camera.width, scene.camera.height],
        lidar=scene.lidar is not None,
        paired=scene.rig is not None,
    )


def described_target(body: Body) -> TargetEntry:
    """Return what dataset.json says of a target."""
    target = body.target
    return TargetEntry(
        id=body.id,
        name=target.name,
        path=target.path,
        size=target.mesh.size.tolist(),
        box=target.mesh.box.tolist(),
        keypoints={name: point.tolist() for name, point in zip(target.keypoint_names, target.keypoints, strict=True)},
    )


def described_parts(bodies: Iterable[tuple[int, int, Sequence[Part]]]) -> Iterator[tuple[str, PartEntry]]:
    """Yield the parts of all bodies by their ids in labels. `bodies`: of each its id, the number of parts before its
    own, and its parts."""
    for target, before, parts in bodies:
        for part in parts:
            entry = PartEntry(path=part.path, class_=part.class_name, name=part.name, target=target)
            yield str(before + part.id), entry


def chosen_device(offered: Sequence[str], scenes: Iterable[Scene]) -> str:
    """Return the first of the devices `offered`, names in DEVICES, that can render all of `scenes`, which are read only
    as far as that is in doubt. Raises UnsupportedError where none can."""
    if DEVICES[offered[0]].shaders:
        return offered[0]
    shaded = next(filter(needs_shader, scenes), None)
    able = [name for name in offered if shaded is None or DEVICES[name].shaders]
    if shaded and not able:
        raise shader_refusal(offered[0], shaded)
    return able[0]


class Coverage:
    """Estimates the pixels that targets cover, by how much of its outline a target fills, seen from any side.

    That share is looked up once a mesh for each side of a half sphere that lies near a line of sight (the back fills
    what the front fills, seen from far away), and kept by mesh and holes; most pictures then cost a few operations.
    Over poses of Tango as SPEED+ has them it is 2 % off, at most 5 %.
    """

    def __init__(self) -> None:
        self._sides, self._caster = half_sphere(SIDES), EmbreeCaster()
        self._filled: dict[tuple[str, str], Float] = {}  # NaN for a side that no picture has been near yet

    def target_pixels(self, scene: Scene) -> float:
        """Return about how many pixels of the picture of `scene` its bodies cover."""
        return min(sum(map(self._pixels, scene.one_body_scenes)), scene.outline_pixels)

    def _pixels(self, scene: OneBody) -> float:
        """Return about how many the target of `scene` covers alone."""
        target, pose = scene.target, scene.T_cam_body
        key = target.mesh.key, target.cut_out_key
        known = self._filled.setdefault(key, np.full(SIDES, np.nan))
        towards = pose.rotation.T @ pose.points(target.mesh.centre)
        along = (self._sides @ towards / max(float(np.linalg.norm(towards)), 1e-300)) ** SHARPNESS
        near = along > FAINTEST * along.max()
        unknown = np.flatnonzero(near & np.isnan(known))  # few sides are ever looked from where pictures are few
        known[unknown] = [filled(scene, side, self._caster) for side in self._sides[unknown]]
        total = float(along[near].sum())
        return scene.outline_pixels * (float(along[near] @ known[near]) / total if total else 1.0)


def filled(scene: OneBody, side: Float, caster: EmbreeCaster) -> float:
    """Return the share of its outline that the target fills for one who looks at it, from afar, along `side` (3,),
    unit, in body axes."""
    mesh = scene.target.mesh
    across = np.cross(side, np.eye(3)[np.abs(side).argmin()])
    across /= np.linalg.norm(across)
    rotation = np.stack([across, np.cross(side, across), side])
    place = FAR * max(mesh.radius, 1e-300) * np.array([0, 0, 1]) - rotation @ mesh.centre
    pose = Transform(to=scene.T_cam_body.to, of=scene.T_cam_body.of, rotation=rotation, translation=place)
    middle = SIDE_PX / 2
    camera = Camera(width=SIDE_PX, height=SIDE_PX, fx=middle * FAR, fy=middle * FAR, cx=middle, cy=middle)
    body = replace(scene.bodies[0].still, T_cam_body=pose)
    seen = replace(scene, camera=camera, bodies=(body,), thin_lens=None, shutter=None)
    pixels = np.count_nonzero(caster.meets(seen, camera.centres(seen.region).reshape(-1, 2)))
    return min(pixels / outline, 1.0) if (outline := seen.outline_pixels) else 1.0
