"""The pictures of a specification: which of them, their poses and their light, each from the seed and its own name
alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.progress import Progress, no_progress
from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.sampling.constraints import CONSTRAINTS, SUN
from spin_usd.sampling.poses import PoseLaw
from spin_usd.sampling.sample import stream
from spin_usd.scene.poses import FRAME_NAME, FRAME_NAME_RULE, PoseList, repeated_name
from spin_usd.scene.scene import NOMINAL
from spin_usd.specifications.sample_pictures import SampledPictures, sample_pictures
from spin_usd.specifications.sample_table import SampleEntry
from spin_usd.specifications.sampling_spec import SamplingPart, SamplingSpec
from spin_usd.stage.augment.attribute_change import BaseStage
from spin_usd.stage.augment.planet import can_be_turned
from spin_usd.stage.augment.sampled_values import SampledValues, concatenated, open_base, overlaid, sampled_values

EARTH_ATTITUDE = "earth.attitude"
DECIMALS = 12  # of sines and cosines, whose last bits differ between machines


@dataclass(frozen=True, kw_only=True)
class PartPicture:
    """One picture: the `picture`th of the `sequence`th of its part, both from 0."""

    part: SamplingPart
    sequence: int
    picture: int

    @property
    def name(self) -> str:
        part = self.part.table
        numbers = {"sequence": part.first_sequence + self.sequence, "picture": part.first_picture + self.picture}
        return part.names.format(**numbers)

    @property
    def sequence_name(self) -> str:
        return f"{self.part.table.name}/{self.sequence}"


def part_pictures(spec: SamplingSpec, count: int | None = None) -> tuple[PartPicture, ...]:
    """All pictures, or `count` of them: from each part its share, the first ones; from a single sequence at even
    intervals.

    Raises InputError for a count beyond the pictures, for 0, and for names that are invalid or not unique.
    """
    count = spec.count if count is None else count
    if not 1 <= count <= spec.count:
        raise InputError(f"count {count} is not 1 to {spec.count}", where=spec.source, do="give a number in this range")
    found: list[PartPicture] = []
    before = 0
    for part in spec.parts:
        before += part.count
        share = (count * before + spec.count // 2) // spec.count - len(found)
        each = part.table.pictures
        every = part.count // max(share, 1) if part.table.sequences == 1 and not isinstance(part.law, PoseLaw) else 1
        numbers = range(0, every * share, every)
        found += [PartPicture(part=part, sequence=i // each, picture=i % each) for i in numbers]
    _check_names([picture.name for picture in found], spec.source)
    return tuple(found)


def _check_names(names: Sequence[str], source: str) -> None:
    """Raise InputError for names that cannot name a picture, and for a name of two pictures."""
    if bad := next((name for name in names if not FRAME_NAME.fullmatch(name)), None):
        raise InputError(f"{bad!r} cannot name a picture", where=source, do=FRAME_NAME_RULE)
    if pair := repeated_name(names):
        do = "put {picture}, {sequence} or the part's name in 'names'"
        raise InputError(f"two pictures are named {names[pair[0]]!r}", where=source, do=do)


def sample_poses(
    chosen: Sequence[PartPicture],
    seed: int,
    camera: Camera,
    hulls: Sequence[Float],
    source: str,
    progress: Progress = no_progress,
) -> PoseList:
    """Sample the poses of the `chosen` pictures; `hulls`: of each the corners (N, 3) of the target that it shows, body
    frame, metres, the same in all of a sequence.

    Raises InputError that names the picture or the sequence that cannot be sampled.
    """

    hull_of = {picture.sequence_name: hull for picture, hull in zip(chosen, hulls, strict=True)}

    @cache
    def sequence(part: SamplingPart, number: int) -> tuple[Float, Float]:
        name = PartPicture(part=part, sequence=number, picture=0).sequence_name
        assert not isinstance(part.law, PoseLaw)
        return part.law.sample(stream(seed, "sequence", name), camera, hull_of[name], part.table.pictures)

    def pose(picture: PartPicture, hull: Float) -> tuple[Float, Float]:
        if isinstance(picture.part.law, PoseLaw):
            return picture.part.law.sample(stream(seed, "pose", picture.name), camera, hull)
        q, t = sequence(picture.part, picture.sequence)
        return q[picture.picture], t[picture.picture]

    found = []
    for done, (picture, hull) in enumerate(zip(chosen, hulls, strict=True)):
        progress("sampling: pose", done, len(chosen))
        try:
            found.append(pose(picture, hull))
        except InputError as error:
            raise type(error)(error.found, where=f"{source}, picture {picture.name}", do=error.do) from None
    q, t = (np.round(each, DECIMALS) + 0.0 for each in zip(*found, strict=True))
    names = tuple(picture.name for picture in chosen)
    return PoseList(names=names, q_cam_body=q, t_cam_body=t, times=_times(chosen), source=source)


def _times(chosen: Sequence[PartPicture]) -> Float | None:
    """Return the seconds (N,) since the start of the pictures' trajectory; None for none, or several."""
    law = chosen[0].part.law
    if isinstance(law, PoseLaw) or len({picture.sequence_name for picture in chosen}) > 1:
        return None
    return np.array([picture.picture * law.step for picture in chosen])


def sample_light(
    stage: Any, chosen: Sequence[PartPicture], seed: int, constraints: Mapping[str, float]
) -> SampledValues:
    """Sample the parameters in the parts of the `chosen` pictures, and return them for their opened `stage`.

    Raises InputError that names the parameter, or the picture and the constraint that cannot be met.
    """
    base, _, _ = open_base(stage)
    earth, found = _another_earth(base, chosen), []
    for part, rows in _rows_of_parts(chosen).items():
        own = replace(base, times=tuple(base.times[i] for i in rows))
        pictures = [chosen[i] for i in rows]
        _refuse_two_suns(part, constraints)
        what = sample_pictures(
            own, pictures_of(pictures), (*part.sample, *earth), seed=seed, name=NOMINAL, constraints=constraints
        )
        if (suns := _inertial_suns(pictures, seed)) is not None:
            what = overlaid(sampled_values(own, {}, {SUN[0]: suns}), what)
        found.append((own.times, what))
    return concatenated(found)


def _another_earth(base: BaseStage, chosen: Sequence[PartPicture]) -> tuple[SampleEntry, ...]:
    """Return the attitude of the stage's planet, sampled for each picture, if no part samples it and all pictures are
    independent of one another."""
    parts = dict.fromkeys(picture.part for picture in chosen)
    sampled = any(entry.parameter == EARTH_ATTITUDE for part in parts for entry in part.sample)
    if sampled or not all(isinstance(part.law, PoseLaw) for part in parts) or not can_be_turned(base):
        return ()
    return (SampleEntry(parameter=EARTH_ATTITUDE, words={"distribution": "attitudes"}, per_frame=True),)


def _inertial_suns(of_part: Sequence[PartPicture], seed: int) -> list[tuple[float, ...]] | None:
    """Return the direction to the Sun in each picture of one part, camera axes; None where its law fixes no Sun among
    the stars."""
    law, pictures = of_part[0].part.law, of_part[0].part.table.pictures
    if isinstance(law, PoseLaw) or law.sun is None:
        return None
    rngs = {each.sequence: stream(seed, "sun", each.sequence_name) for each in of_part}
    suns = {sequence: law.sun_directions(rng, pictures) for sequence, rng in rngs.items()}
    return [tuple(map(float, np.round(suns[each.sequence][each.picture], DECIMALS) + 0.0)) for each in of_part]


def _refuse_two_suns(part: SamplingPart, constraints: Mapping[str, float]) -> None:
    """Raise InputError if the part's orbit fixes the Sun, and a sample or constraint would decide it too."""
    if isinstance(part.law, PoseLaw) or part.law.sun is None:
        return
    others = [entry.parameter for entry in part.sample if entry.parameter in SUN]
    others += [name for name in constraints if SUN[0] in CONSTRAINTS[name].bears_on]
    if others:
        found = f"has a Sun fixed by its trajectory, and {others[0]}"
        raise InputError(found, where=f"part {part.table.name!r}", do=f"leave out {others[0]}, or the trajectory's sun")


def pictures_of(of_part: Sequence[PartPicture]) -> SampledPictures:
    """Return the pictures of one part by their names, and by their sequences for parameters per sequence."""
    sequences = tuple(picture.sequence_name for picture in of_part)
    shared = dict.fromkeys(of_part[0].part.sequential, sequences)
    return SampledPictures(names=tuple(picture.name for picture in of_part), shared=shared)


def _rows_of_parts(chosen: Sequence[PartPicture]) -> Mapping[SamplingPart, Sequence[int]]:
    """Return by part the places of its own pictures among the chosen ones. Raises InputError for a parameter that some
    parts sample and others do not."""
    rows: dict[SamplingPart, list[int]] = {}
    for i, picture in enumerate(chosen):
        rows.setdefault(picture.part, []).append(i)
    sampled = [_sampled_of(part) for part in rows]
    for parameter in sorted(set().union(*sampled)):
        if not all(parameter in each for each in sampled):
            found = "is sampled in some parts only"
            raise InputError(found, where=f"sample {parameter!r}", do="sample it in all parts")
    return rows


def _sampled_of(part: SamplingPart) -> set[str]:
    """Return the parameters that are sampled for the part's pictures; the Sun of an orbit is one."""
    fixes_sun = not isinstance(part.law, PoseLaw) and part.law.sun is not None
    return {entry.parameter for entry in part.sample} | ({SUN[0]} if fixes_sun else set())
