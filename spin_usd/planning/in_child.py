"""Plan every picture of a run, with its keys, in child processes, because planning opens the stage.

`open_plan` copies and describes the stage; `plan_pictures` does the long work, of some of the pictures in all variants,
so that several processes can share it. Pictures come as columns: there may be a million.
"""

import shutil
import time
from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.progress import Progress, no_progress
from spin_usd.errors import InputError
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.geometry.directions import sphere
from spin_usd.geometry.triangles import unit_normals, unit_vectors
from spin_usd.planning.columns import PLANNING
from spin_usd.planning.picture_columns import PicturePlanner
from spin_usd.planning.plan_calls import (
    OpenedStage,
    OpenPlan,
    PlannedPart,
    PlanPart,
    StageContent,
    described_parts,
    described_target,
)
from spin_usd.planning.skipped_counts import SkippedWorkCounter
from spin_usd.renderers.device import DEVICES, needs_shader, shader_refusal
from spin_usd.renderers.embree.caster import mesh_scene
from spin_usd.scene.derived.views import ViewCollector
from spin_usd.scene.finding import in_sentences
from spin_usd.scene.scene import NOMINAL, Scene, augmentation_and_camera
from spin_usd.stage.author.target_root import origin_of
from spin_usd.stage.composition.copy_stage import copy_stage
from spin_usd.stage.read.stage_reader import StageReader


class StagePlanner:
    """A stage to plan, opened by `open_plan` if given."""

    opened: OpenedStage

    def __init__(self, request: OpenPlan | None = None, progress: Progress = no_progress) -> None:
        self._reader: StageReader | None = None
        if request:
            self.opened, self._reader = open_plan(request, progress)

    def pictures(self, request: PlanPart, progress: Progress) -> list[PlannedPart]:
        """Plan some of its pictures, as plan_pictures; open the stage of the request if none is open yet."""
        return plan_pictures(request, progress, self._reader)


def open_plan(request: OpenPlan, progress: Progress = no_progress) -> tuple[OpenedStage, StageReader]:
    """Return the description of the stage as a whole; and the stage's reader, for `plan_pictures`."""
    root = Path(request.stage)
    if request.copy_to:
        shutil.rmtree(request.copy_to, ignore_errors=True)  # half a copy by a child that died
        root = copy_stage(root, Path(request.copy_to))
    several = bool(request.variants)  # perhaps: then poses are kept for later readers
    reader = StageReader(root, check_images=request.renders, keep_poses=several)
    frames = range(len(reader.frames))
    chosen = frames[slice_of(request.frames)] if request.frames else frames
    if not chosen:
        found = f"frames {request.frames!r} selects none of the {len(reader.frames)} frames"
        raise InputError(found, where=request.stage, do="count from 0; 0:10 are the first ten")
    wanted = wanted_variants(request.variants, reader.variants)
    opened = OpenedStage(
        root=str(root),
        seed=reader.seed if request.seed is None else request.seed,
        variants=list(wanted),
        device=chosen_device(request.devices, _scenes(root, reader, wanted, chosen)),
        known_variants=list(reader.variants),
        names=[frame.name for frame in reader.frames],
        chosen=list(chosen),
        origin=origin_of(reader.stage),
        content=stage_content(reader, progress),
        trial_s=trial_seconds() if request.trial else None,
    )
    return opened, reader


def plan_pictures(request: PlanPart, progress: Progress, opened: StageReader | None = None) -> list[PlannedPart]:
    """Plan the chosen frames in each of the variants. `progress` counts all of them; `opened`: a reader of the stage,
    in any variant. Raises UnsupportedError where image files cannot hold a sensor's numbers."""
    counter = SkippedWorkCounter(request.settings) if request.explain else None
    several, renders = len(request.variants) > 1, request.renders
    planner = PicturePlanner(
        request.settings, request.image_suffix, request.labels, counter, renders=renders, keep_poses=several
    )
    answer = []
    before: dict[str, list[Any]] = {}
    reader, total = opened, len(request.variants) * len(request.chosen)
    for number, variant in enumerate(request.variants):
        count = partial(_report, progress, number * len(request.chosen), total)
        if reader is None or reader.variant != variant:
            reader = StageReader(request.root, variant=variant, after=reader, check_images=renders, keep_poses=several)
        views = ViewCollector(f"{variant}/" if several else "")
        planned = planner.columns(reader, request.chosen, views, count)
        part = PlannedPart(
            variant=variant,
            stage=reader.provenance(Path(request.root).name) if variant in request.provenance else None,
            skipped=counter.taken() if counter else [],
            notes=list(in_sentences(reader.notes)),
            views=views.views(),
            columns={name: None if column == before.get(name) else column for name, column in planned.items()},
        )
        answer.append(part)
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


def wanted_variants(asked: Sequence[str], known: Sequence[str]) -> list[str]:
    """Return the `known` variants that the names and patterns `asked` choose, each once; without any the nominal one,
    as all cameras see it.

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


def stage_content(reader: StageReader, progress: Progress = no_progress) -> StageContent:
    """Return the bodies for dataset.json, and the camera's facts for a plan."""
    scene = reader.scene(reader.frames[0])
    hidden = []
    for target in reader.bodies.hidden_targets_at(reader.frames[0].time_code):
        hidden.append(target)
        progress(READING, len(hidden), len(reader.bodies))
    targets = sorted((*scene.targets, *hidden), key=lambda body: body.id)
    return StageContent(
        targets=[described_target(body) for body in targets],
        parts=dict(described_parts(reader.numbering.bodies, (*scene.bodies, *hidden))),
        bodies=len(reader.bodies),
        camera=[scene.camera.width, scene.camera.height],
        lidar=scene.lidar is not None,
        event_camera=reader.event_sensor(reader.frames[0]) is not None,
        paired=scene.rig is not None,
    )


def chosen_device(offered: Sequence[str], scenes: Iterable[Scene]) -> str:
    """Return the first of the devices `offered`, names in DEVICES, that can render all of `scenes`; reads scenes only
    while this is in doubt. Raises UnsupportedError if none can."""
    if DEVICES[offered[0]].shaders:
        return offered[0]
    shaded = next(filter(needs_shader, scenes), None)
    able = [name for name in offered if shaded is None or DEVICES[name].shaders]
    if shaded and not able:
        raise shader_refusal(offered[0], shaded)
    return able[0]


READING = "reading: body"
ROWS = 40  # of the body's faces, twice as many around
BUMPS = 7  # around it, so that rays are soon going all ways
RAYS = 512  # at a time
BOUNCES = 96
ROUNDS = 3  # the fastest counts: other work only makes rounds longer; it is within 2 % of the fastest of many
AHEAD = 1e-4  # of the body's size: distance from a wall at which a ray starts, so that it does not meet the wall again


def trial_seconds() -> float:
    """Return the processor seconds of a round, some 0.02 s."""
    points, faces = _hollow_body()
    scene, normals = mesh_scene(points.astype(np.float32), faces), unit_normals(points[faces])
    seconds = []
    for _ in range(ROUNDS):
        began = time.thread_time()
        origins, directions = np.zeros((RAYS, 3)), sphere(RAYS)
        for _ in range(BOUNCES):
            met = np.asarray(scene.run(origins.astype(np.float32), directions.astype(np.float32)), np.int32)
            normal, corner = normals[met], points[faces[met, 0]]
            along = (directions * normal).sum(axis=1)
            origins = origins + directions * (((corner - origins) * normal).sum(axis=1) / along)[:, None]
            origins *= 1 - AHEAD
            directions = unit_vectors(directions - 2 * along[:, None] * normal)
        seconds.append(time.thread_time() - began)
    return min(seconds)


def _hollow_body() -> tuple[Float, NDArray[np.int32]]:
    """Return points (P, 3) and triangles (F, 3) of a bumpy closed body around the origin, about one in radius."""
    turn, height = np.meshgrid(np.arange(2 * ROWS) * np.pi / ROWS, np.linspace(0, np.pi, ROWS + 1))
    radius = 1 + 0.1 * np.sin(BUMPS * turn) * np.sin(height) * np.sin(BUMPS * height)
    flat = radius * np.sin(height)
    points = np.stack([flat * np.cos(turn), flat * np.sin(turn), radius * np.cos(height)], axis=-1)
    numbers = np.arange(turn.size, dtype=np.int32).reshape(turn.shape)
    here, below = numbers[:-1], numbers[1:]
    beside, across = np.roll(here, -1, axis=1), np.roll(below, -1, axis=1)
    towards_top = np.stack([here, across, beside], axis=-1)[1:]  # the poles are points: a row has half its faces there
    towards_bottom = np.stack([here, below, across], axis=-1)[:-1]
    return points.reshape(-1, 3), np.concatenate([towards_top.reshape(-1, 3), towards_bottom.reshape(-1, 3)])
