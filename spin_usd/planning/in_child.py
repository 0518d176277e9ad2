"""Plan every picture that a run would make, with its keys, in child processes, for it opens the stage.

`open_plan` copies and describes the stage; `plan_pictures` does the long work, of some of the pictures in all variants,
so that several processes can share it. Pictures come as columns: there may be a million.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Any

from msgspec import convert, to_builtins

from spin_usd.basics.progress import Progress
from spin_usd.errors import InputError
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.planning.columns import PLANNING
from spin_usd.planning.opened_stage import OpenedStage, StageContent, described_parts, described_target
from spin_usd.planning.picture_columns import PicturePlanner
from spin_usd.planning.skipped_counts import SkippedWorkCounter
from spin_usd.planning.speed_trial import trial_seconds
from spin_usd.renderers.device import DEVICES, needs_shader, shader_refusal
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.views import ViewCollector
from spin_usd.scene.effort import CPU
from spin_usd.scene.finding import in_sentences
from spin_usd.scene.scene import NOMINAL, Scene, augmentation_and_camera
from spin_usd.stage.author.target_root import origin_of
from spin_usd.stage.composition.copy_stage import copy_stage
from spin_usd.stage.read.stage_reader import StageReader


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
        content=stage_content(reader),
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
    planner = PicturePlanner(rendering, image_suffix, labels, counter, renders=renders, keep_poses=len(variants) > 1)
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


def stage_content(reader: StageReader) -> StageContent:
    """Return what dataset.json says of the bodies, and what a plan needs of the camera."""
    scene = reader.scene(reader.frames[0])
    return StageContent(
        targets=[described_target(body) for body in scene.targets],
        parts=dict(described_parts(reader.numbering.bodies, scene.bodies)),
        bodies=len(reader.bodies),
        camera=[scene.camera.width, scene.camera.height],
        lidar=scene.lidar is not None,
        event_camera=reader.event_sensor(reader.frames[0]) is not None,
        paired=scene.rig is not None,
    )


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
