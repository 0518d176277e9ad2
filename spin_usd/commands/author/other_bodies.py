"""The bodies beside the first target: where each is in every picture, and writing them into the stage.

Those whose poses are sampled keep apart from all others and from the camera, as balls around them do.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import reading
from spin_usd.basics.unique_names import UniqueNames
from spin_usd.commands.author.authoring import Authoring
from spin_usd.commands.author.model import OtherBody, axes_note, model_unit, write_model
from spin_usd.commands.author.plausible_target import refuse_size
from spin_usd.commands.author.smooth_poses import smooth_poses
from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.formats.checked_document import read_as
from spin_usd.formats.chosen_frames import chosen_frames
from spin_usd.formats.mesh.mesh_file import MESHES, says_unit
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.sampling.attitudes import Attitudes
from spin_usd.sampling.poses import Balls, BesideLaw, PoseLaw, PositionLaw, ball_of
from spin_usd.sampling.sample import stream
from spin_usd.sampling.trajectory import TrajectoryLaw
from spin_usd.scene.poses import PoseList
from spin_usd.specifications.part_pictures import DECIMALS
from spin_usd.specifications.sampling_tables import BodyPoses, inside_law
from spin_usd.stage.author.from_mesh_file import target_name
from spin_usd.stage.author.other_bodies import add_occluder, add_target
from spin_usd.stage.author.source_bounds import box_corners, hull_corners
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.author.write_stage import ROOT

CAMERA_ITSELF = (np.zeros(3), 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class _PlacedBody:
    """A body with its poses: one for each picture, or one for all. None: not sampled yet, or in the camera's axes."""

    body: OtherBody
    asset: TargetAsset
    poses: PoseList | None


def write_others(making: Authoring) -> None:
    """Write the bodies after the first target over the stage, with notes. --units-per-metre applies to models whose
    files do not state their unit. Raises InputError, OutputError."""
    folder, units_per_metre = making.folder, making.options.units_per_metre
    notes: dict[str, None] = {}  # each once, though there are several bodies of one model
    names = UniqueNames(taken=[making.target.name])

    @cache
    def model(file: Path) -> tuple[TargetAsset, tuple[str, ...]]:
        return write_model(file, folder, _unit(file, units_per_metre), None)

    placed = []
    for body in making.sources.others:
        asset, said = model(body.file)
        own = _own_poses(body, making)
        own = smooth_poses(own, making.poses.times) if own and len(own) > 1 and not body.occluder else own
        notes |= dict.fromkeys((*said, *(own.notes if own else ())))
        meant = "its poses are meant in these"
        if body.occluder and not own:
            meant = "they are the camera's, x right, y down, z forward"
        elif not (own or _is_sampled(body, making)):
            own, meant = making.poses, "they are the first target's, with which it moves"
        notes |= dict.fromkeys(axes_note(body.file, asset, meant, whose=f"{body.file.name}: its", crafts=making.crafts))
        for _ in range(body.said.count):
            named = replace(asset, name=names.give(target_name(body.file.stem)))
            placed.append(_PlacedBody(body=body, asset=named, poses=own))
        if _is_sampled(body, making):
            if not making.options.any_size:
                refuse_size(box_corners(asset), model_unit(body.file, asset, _unit(body.file, units_per_metre)))
            if not body.said.text:
                found = f"{asset.name} is sampled as the target is, and apart from it"
                notes[f"{found}; MODEL:attached moves it with the target instead"] = None
    for each in _all_placed(placed, making):
        if each.body.occluder:
            add_occluder(folder / ROOT, each.asset, each.poses)
        else:
            assert each.poses is not None
            add_target(folder / ROOT, each.asset, each.poses)
    making.notes += notes


def _unit(file: Path, units_per_metre: float | None) -> float | None:
    """Return `units_per_metre` for a model whose file does not state its unit, None for any other."""
    return None if file.suffix.lower() not in MESHES or says_unit(file) else units_per_metre


def _is_sampled(body: OtherBody, making: Authoring) -> bool:
    if body.occluder or body.poses or body.attached:
        return False
    return bool(body.said.text) or making.pictures.laws is not None


def _own_poses(body: OtherBody, making: Authoring) -> PoseList | None:
    """Return the poses of the body's own list, None where it has none."""
    if body.poses is None:
        return None
    with reading(body.poses):
        own = read_pose_list(body.poses)
    if len(own) == 1 and body.occluder:
        return own
    if len(own) != making.pictures.whole:
        _refuse_other_length(own, making)
    return chosen_frames(own, making.options.frames)


def _refuse_other_length(own: PoseList, making: Authoring) -> None:
    """Raise InputError for a list that has another number of poses than there are pictures to choose from."""
    whole, frames = making.pictures.whole, making.options.frames
    count = f"{whole} picture{'s' * (whole > 1)}"
    wanted = count if frames is None else f"the {count} that frames {frames!r} chooses from"
    found = f"has {len(own)} pose{'s' * (len(own) > 1)} for {wanted}"
    raise InputError(found, where=own.source, do="give a pose for each picture, in their order")


def _all_placed(placed: Sequence[_PlacedBody], making: Authoring) -> Sequence[_PlacedBody]:
    """Return the bodies with sampled poses filled in, each clear of all bodies before it in the list, and of bodies
    that are not sampled: a further body at the end changes no other."""
    sampled = [i for i, each in enumerate(placed) if _is_sampled(each.body, making)]
    if not sampled:
        return placed
    models = {asset.file: asset for asset in (making.target, *(each.asset for each in placed))}
    hulls = {file: hull_corners(asset) for file, asset in models.items()}
    known = [placed[i] for i in range(len(placed)) if i not in sampled]
    balls = [CAMERA_ITSELF, _balls(making.poses, hulls[making.target.file])]
    balls += [_balls(each.poses, hulls[each.asset.file]) for each in known]
    found = list(placed)
    for i in sampled:
        hull = hulls[placed[i].asset.file]
        poses = _sampled_poses(placed[i], making, hull, balls)
        balls.append(_balls(poses, hull))
        found[i] = replace(placed[i], poses=poses)
    return found


def _balls(poses: PoseList | None, hull: Float) -> tuple[Float, float]:
    """Return the middles (N, 3), or (3,) in all pictures, and the radius of the ball around a body, camera frame."""
    middle, radius = ball_of(hull)
    if poses is None:
        return middle, radius
    return matrices_from_quaternions(poses.q_cam_body) @ middle + poses.t_cam_body, radius


def _sampled_poses(
    placed: _PlacedBody, making: Authoring, hull: Float, balls: Sequence[tuple[Float, float]]
) -> PoseList:
    """Sample the poses of a body with the corners `hull`, apart from the `balls`, each from the seed, the body's name
    and the picture's alone. Raises InputError that names the body and the picture."""
    names, name = making.poses.names, placed.asset.name
    middles = np.stack([np.broadcast_to(each, (len(names), 3)) for each, _ in balls], axis=1)
    radii = np.array([radius for _, radius in balls])
    law_of = cache(lambda usual: _law(placed, usual))
    found = []
    for i, picture in enumerate(names):
        making.progress(f"sampling: pose of {name}", i, len(names))
        law = law_of(making.pictures.laws[i] if making.pictures.laws else None)
        try:
            if isinstance(law.position, BesideLaw):
                x, y, z = making.poses.t_cam_body[i].tolist()
                law = replace(law, position=replace(law.position, other=(x, y, z)))
            others = Balls(middles=middles[i], radii=radii)
            found.append(
                law.sample(stream(making.options.seed, "pose", name, picture), making.sources.lens, hull, others)
            )
        except InputError as error:
            raise InputError(error.found, where=f"{name}, picture {picture}", do=error.do) from None
    q, t = (np.round(each, DECIMALS) + 0.0 for each in zip(*found, strict=True))
    return PoseList(names=names, q_cam_body=q, t_cam_body=t, source=name)


def _law(placed: _PlacedBody, usual: PoseLaw | TrajectoryLaw | None) -> PoseLaw:
    """Return the law of a body's poses. Missing values are taken from the target's own law, `usual`, but all attitudes
    are equally likely. Raises InputError if that is not enough."""
    if isinstance(usual, TrajectoryLaw):
        do = "give it a pose list, MODEL:POSES, or move it with the target, MODEL:attached"
        raise InputError("poses along a trajectory are sampled for the target alone", where=placed.asset.name, do=do)
    where = placed.body.said.text
    said = read_as(BodyPoses, placed.body.said.poses, where)
    inside = inside_law(said.inside, where) if said.inside is not None or usual is None else usual.inside
    return PoseLaw(position=_position(said, where, usual), attitude=said.attitude or Attitudes(), inside=inside)


def _position(said: BodyPoses, where: str, usual: PoseLaw | None) -> PositionLaw | BesideLaw:
    if said.distance:
        return BesideLaw(range=said.distance)
    if own := said.range or said.range_diameters:
        return PositionLaw(range=own, in_diameters=said.range is None, place=said.place(None, where))
    if usual is None:
        raise InputError("has no distance of the body", where=where, do="add distance=1..5, metres from the target")
    assert isinstance(usual.position, PositionLaw)
    shares = said.u_share or said.v_share
    return replace(usual.position, place=said.place(None, where)) if shares else usual.position
