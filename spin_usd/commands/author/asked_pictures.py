"""The requested pictures of a stage: from a pose list, or sampled."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import reading
from spin_usd.basics.progress import Progress
from spin_usd.commands.author.options import AuthorOptions
from spin_usd.commands.author.scenario_pictures import ENVIRONMENT, ScenarioPictures
from spin_usd.commands.author.smooth_poses import smooth_poses
from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.formats.chosen_frames import chosen_frames, slice_of
from spin_usd.geometry.camera import Camera
from spin_usd.sampling.poses import PoseLaw
from spin_usd.sampling.trajectory import TrajectoryLaw
from spin_usd.scene.poses import PoseList
from spin_usd.specifications.part_pictures import part_pictures, sample_light, sample_poses
from spin_usd.specifications.sampling_spec import open_spec
from spin_usd.stage.augment.sampled_values import SampledValues

FIXED = "fixed"
OF_SPEC = ("target", "camera", "preset", "lights", "environment")
"""The options in whose place a specification may have names of its own."""


Corners: TypeAlias = Callable[[bool], Sequence[Float]]
"""Returns for each picture corners (N, 3) of the target that it shows, body axes, metres: of its convex hull if True,
of its box otherwise."""


@dataclass(frozen=True, kw_only=True, eq=False)
class AskedPictures:
    """The requested pictures of a stage, before there is a camera and a target to sample them for."""

    files: Mapping[str, Path]
    """Source files, by their roles."""
    whole: int
    """How many there were to choose from."""
    poses: Callable[[Camera, Corners], PoseList]
    """Returns the poses for a camera, and the corners of what is shown."""
    sequences: Sequence[str]
    """Names of the sequences that its pictures belong to; a picture alone is one."""
    light: Callable[[Any], SampledValues] | None = None
    """Returns the sampled values for the opened stage; None for a pose list."""
    laws: Sequence[PoseLaw | TrajectoryLaw] | None = None
    """Distribution of each pose; None for a pose list."""
    drawn: frozenset[str] = frozenset()
    """Parameters that are drawn for each picture."""
    drawn_once: tuple[str, ...] = ()
    """Parameters that are drawn for all pictures of a part together."""


def asked_pictures(options: AuthorOptions, progress: Progress) -> tuple[AuthorOptions, AskedPictures]:
    """Return the requested pictures, and the options with those from a specification filled in. Raises InputError."""
    if options.scenario is not None:
        return _of_scenario(options, progress)
    return _listed(options) if options.sample is None else _sampled(options, progress)


def _of_scenario(options: AuthorOptions, progress: Progress) -> tuple[AuthorOptions, AskedPictures]:
    assert options.scenario is not None
    with reading(options.scenario):
        pictures = ScenarioPictures(options.scenario, options.frames, progress)
    files, whole = pictures.files, pictures.whole
    environment = options.environment or (ENVIRONMENT if options.background is None else None)
    asked = AskedPictures(
        files=files,
        whole=whole,
        poses=lambda camera, corners: pictures.poses,
        sequences=("",) * len(pictures.poses),
        light=pictures.light,
    )
    return replace(options, environment=environment), asked


def _listed(options: AuthorOptions) -> tuple[AuthorOptions, AskedPictures]:
    assert options.poses is not None
    with reading(options.poses):
        found = read_pose_list(options.poses)
    listed = smooth_poses(found, found.times)
    chosen = chosen_frames(listed, options.frames)
    files = {"poses": Path(options.poses)}
    return options, AskedPictures(
        files=files, whole=len(listed), poses=lambda camera, corners: chosen, sequences=chosen.names
    )


def _sampled(options: AuthorOptions, progress: Progress) -> tuple[AuthorOptions, AskedPictures]:
    assert options.sample is not None
    spec = open_spec(options.sample, options.count)
    made = part_pictures(spec, options.count)
    chosen = made if options.frames is None else made[slice_of(options.frames)]
    if not chosen:
        raise InputError(f"frames {options.frames!r} chooses none of {len(made)} pictures")
    own = {name: getattr(options, name) or getattr(spec.table, name) for name in OF_SPEC}
    if missing := next((name for name in ("target", "camera") if not own[name]), None):
        raise InputError(f"names no {missing}", where=spec.source, do=f"give {missing} too")
    laws = [picture.part.law for picture in chosen]

    def poses(camera: Camera, corners: Corners) -> PoseList:
        shown = corners(any(law.needs_hull for law in laws))  # nothing else needs the hull
        sampled = sample_poses(chosen, options.seed, camera, shown, spec.source, progress)
        return smooth_poses(sampled, sampled.times)

    def light(stage: Any) -> SampledValues:
        return sample_light(stage, chosen, options.seed, spec.table.constraints)

    files = {"sample": spec.file} if spec.file else {}
    entries = [each for part in spec.parts for each in part.sample if each.words["distribution"] != FIXED]
    once = dict.fromkeys(each.parameter for each in entries if not each.per_frame)
    asked = AskedPictures(
        files=files,
        whole=len(made),
        poses=poses,
        sequences=[each.name if isinstance(each.part.law, PoseLaw) else each.sequence_name for each in chosen],
        light=light,
        laws=laws,
        drawn=frozenset(each.parameter for each in entries) - once.keys(),
        drawn_once=tuple(once),
    )
    return replace(options, **own), asked
