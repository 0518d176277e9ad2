"""The child's part of a stream of pictures: poses and appearances drawn by specifications."""

from dataclasses import replace

import numpy as np
from msgspec import structs

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.transform import Transform
from spin_usd.sampling.poses import Balls, PoseLaw, ball_of
from spin_usd.sampling.sample import Sample, stream
from spin_usd.scene.scene import Scene
from spin_usd.specifications.appearances import Appearance, read_appearances
from spin_usd.specifications.part_pictures import DECIMALS
from spin_usd.specifications.sample_pictures import SampledPictures, draw_values, samples_on
from spin_usd.specifications.sample_table import SampleEntry
from spin_usd.specifications.sampling_spec import SamplingPart, SamplingSpec, open_spec
from spin_usd.stage.augment.background import beside
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.picture_request import Matrix, PictureRequest, plain


class DrawnPictures:
    """Draws the values that requests leave to specifications."""

    def __init__(self) -> None:
        self._appearances: dict[str, list[Appearance]] = {}
        self._poses: dict[str, SamplingSpec] = {}
        self._samples: dict[tuple[object, ...], tuple[Sample, ...]] = {}

    def drawn(self, asked: PictureRequest, stage: OpenStage) -> PictureRequest:
        """Return the request with the values drawn for it. Raises InputError."""
        assert asked.drawn is not None
        of, number = asked.drawn, str(asked.drawn.number)
        name, of_what = f"drawn.{number}", [asked.variant]
        entries: dict[str, SampleEntry] = {}
        constraints: dict[str, float] = {}
        behind: dict[str, str] = {}
        if of.poses is not None:
            frame = stage.reader(asked.variant).scene(stage.frame(asked))
            spec, part, pose = self._pose(of.poses, of.seed, number, frame)
            asked = structs.replace(asked, poses={**asked.poses, "": pose})
            of_what += [of.poses, part.table.name]
            entries |= {each.parameter: each for each in part.sample}
            constraints |= spec.table.constraints
        if of.spec is not None:
            appearance = self._appearance(of.spec, of.seed, number)
            name = f"{appearance.entry.name}.{number}"
            asked = structs.replace(asked, selections=dict(appearance.entry.select))
            of_what += [of.spec, appearance.entry.name]
            entries |= {each.parameter: each for each in appearance.others}
            constraints |= appearance.entry.constraints
            behind = {
                parameter: str(beside(appearance.folder, file))
                for parameter, file in appearance.photograph(of.seed, name, "").items()
            }
        base = stage.base(asked)
        if (key := tuple(of_what)) not in self._samples:
            once = [replace(each, per_frame=False) for each in entries.values()]
            self._samples[key] = samples_on(base, once)
        picture = SampledPictures(names=(str(asked.name),))
        drawn = draw_values(base, picture, self._samples[key], seed=of.seed, name=name, constraints=constraints)
        return structs.replace(asked, values={**plain(drawn.constant), **behind}, drawn=None)

    def _pose(self, given: str, seed: int, number: str, of_frame: Scene) -> tuple[SamplingSpec, SamplingPart, Matrix]:
        if given not in self._poses:
            self._poses[given] = open_spec(given, 1)
        spec = self._poses[given]
        chance = stream(seed, "part", number).random() * spec.count
        ends = np.cumsum([part.count for part in spec.parts])
        part = spec.parts[int(np.searchsorted(ends, chance, side="right"))]
        if not isinstance(part.law, PoseLaw):
            do = "give the poses of trajectories one by one"
            raise InputError("samples trajectories", where=f"{spec.source}, part {part.table.name}", do=do)
        first, *others = of_frame.bodies
        balls = [ball_of(body.T_cam_body.points(body.target.mesh.hull)) for body in others]
        apart = Balls(
            middles=np.array([middle for middle, _ in balls]).reshape(-1, 3),
            radii=np.array([each for _, each in balls]),
        )
        hull = first.target.mesh.hull
        q, t = part.law.sample(stream(seed, "pose", number), of_frame.camera, hull, apart)
        return spec, part, _rounded(q, t)

    def _appearance(self, spec: str, seed: int, number: str) -> Appearance:
        if spec not in self._appearances:
            self._appearances[spec] = read_appearances(spec)
        every = self._appearances[spec]
        return every[int(stream(seed, "appearance", number).integers(len(every)))]


def _rounded(q: Float, t: Float) -> Matrix:
    """Return the pose as `author` samples it: the same on every machine."""
    rotation, place = np.round(q, DECIMALS) + 0.0, np.round(t, DECIMALS) + 0.0
    matrix: Matrix = Transform.from_quaternion(to="cam", of="body", q=rotation, t=place).matrix.tolist()
    return matrix
