"""An example's pictures: which of them, their poses and their light, each from the seed and its own name alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.arrays import Float
from spin_usd.dataset.author.example import Example, ExamplePart
from spin_usd.dataset.author.sample_pictures import SampledPictures, sample_pictures
from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.sampling.poses import PoseLaw
from spin_usd.sampling.stream import stream
from spin_usd.scene.model import NOMINAL
from spin_usd.scene.source.poses import FRAME_NAME, FRAME_NAME_RULE, PoseList, repeated_name
from spin_usd.stage.augment.sampled_values import SampledValues, concatenated, open_base

DECIMALS = 12  # of what sines and cosines gave, whose last bit differs from machine to machine


@dataclass(frozen=True, kw_only=True)
class ExamplePicture:
    """One picture: the `picture`th of the `sequence`th of its part, both from 0."""

    part: ExamplePart
    sequence: int
    picture: int

    @property
    def name(self) -> str:
        part = self.part
        numbers = {"sequence": part.first_sequence + self.sequence, "picture": part.first_picture + self.picture}
        return part.names.format(**numbers)

    @property
    def sequence_name(self) -> str:
        return f"{self.part.name}/{self.sequence}"


def example_pictures(example: Example, count: int | None = None) -> tuple[ExamplePicture, ...]:
    """All pictures, or `count` of them: of each part the first, as many as is its share.

    Raises InputError for more than there are, for none, and for names that are none or not unique.
    """
    count = example.count if count is None else count
    if not 1 <= count <= example.count:
        raise InputError(f"count {count} is not 1 to {example.count}", where=example.file, do="give one of those")
    found: list[ExamplePicture] = []
    before = 0
    for part in example.parts:
        before += part.count
        share = (count * before + example.count // 2) // example.count - len(found)
        found += [
            ExamplePicture(part=part, sequence=i // part.pictures, picture=i % part.pictures) for i in range(share)
        ]
    _check_names([picture.name for picture in found], example.file)
    return tuple(found)


def _check_names(names: Sequence[str], file: Path) -> None:
    """Raise InputError for names that cannot be a picture's, and for one that two pictures have."""
    if bad := next((name for name in names if not FRAME_NAME.fullmatch(name)), None):
        raise InputError(f"{bad!r} cannot name a picture", where=file, do=FRAME_NAME_RULE)
    if pair := repeated_name(names):
        do = "put {picture}, {sequence} or the part's name in 'names'"
        raise InputError(f"two pictures are named {names[pair[0]]!r}", where=file, do=do)


def sample_poses(chosen: Sequence[ExamplePicture], seed: int, camera: Camera, hull: Float, source: str) -> PoseList:
    """Sample the poses of the `chosen` pictures, of a target with the corners `hull` (N, 3), body frame, metres.

    Raises InputError that names the picture or the sequence for one that cannot be had.
    """

    @cache
    def sequence(part: ExamplePart, number: int) -> tuple[Float, Float]:
        picture = ExamplePicture(part=part, sequence=number, picture=0)
        rng = stream(seed, "sequence", picture.sequence_name)
        assert not isinstance(part.law, PoseLaw)
        return part.law.sample(rng, camera, hull, part.pictures)

    def pose(picture: ExamplePicture) -> tuple[Float, Float]:
        if isinstance(picture.part.law, PoseLaw):
            return picture.part.law.sample(stream(seed, "pose", picture.name), camera, hull)
        q, t = sequence(picture.part, picture.sequence)
        return q[picture.picture], t[picture.picture]

    found = []
    for picture in chosen:
        try:
            found.append(pose(picture))
        except InputError as error:
            raise InputError(error.found, where=f"{source}, picture {picture.name}", do=error.do) from None
    q, t = (np.round(each, DECIMALS) + 0.0 for each in zip(*found, strict=True))
    return PoseList(names=tuple(picture.name for picture in chosen), q_cam_body=q, t_cam_body=t, source=source)


def sample_light(
    stage: Any, chosen: Sequence[ExamplePicture], seed: int, constraints: Mapping[str, float]
) -> SampledValues:
    """Sample what the parts of the `chosen` pictures ask for, and return it for their opened `stage`.

    Raises InputError that names the parameter, or the picture and the constraint that cannot be met.
    """
    base, _, _ = open_base(stage)
    found = []
    for part, rows in _rows_of_parts(chosen).items():
        own = replace(base, times=tuple(base.times[i] for i in rows))
        pictures = pictures_of([chosen[i] for i in rows])
        what = sample_pictures(own, pictures, part.sample, seed=seed, name=NOMINAL, constraints=constraints)
        found.append((own.times, what))
    return concatenated(found)


def pictures_of(of_part: Sequence[ExamplePicture]) -> SampledPictures:
    """Return the pictures of one part by their names, and by their sequences for what is sampled for those."""
    sequences = tuple(picture.sequence_name for picture in of_part)
    shared = dict.fromkeys(of_part[0].part.sequential, sequences)
    return SampledPictures(names=tuple(picture.name for picture in of_part), shared=shared)


def _rows_of_parts(chosen: Sequence[ExamplePicture]) -> Mapping[ExamplePart, Sequence[int]]:
    """Return by part the places of its own pictures among the chosen ones. Raises InputError for a parameter that some
    parts sample and others do not."""
    rows: dict[ExamplePart, list[int]] = {}
    for i, picture in enumerate(chosen):
        rows.setdefault(picture.part, []).append(i)
    sampled = [{entry.parameter for entry in part.sample} for part in rows]
    for parameter in sorted(set().union(*sampled)):
        if not all(parameter in each for each in sampled):
            found = "is sampled in some parts only"
            raise InputError(found, where=f"sample {parameter!r}", do="sample it in all parts")
    return rows
