"""`spin-usd author`: pose list or sampling specification + model + camera -> a layered stage."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from spin_usd.arrays import Float
from spin_usd.commands.author.additions import Additions, read_additions
from spin_usd.commands.author.augment import augment_stage
from spin_usd.commands.author.cameras import CALIBRATIONS
from spin_usd.commands.author.choices import Choices, Sources, open_sources, selections
from spin_usd.commands.author.model import axes_note, is_users, model_unit, write_model
from spin_usd.commands.author.other_bodies import AuthoredPictures, write_others
from spin_usd.commands.author.part_pictures import PartPicture, part_pictures, sample_light, sample_poses
from spin_usd.commands.author.plausible_target import notes_on_far_keypoints, refuse_implausible, refuse_size
from spin_usd.commands.author.reports import AuthorReport
from spin_usd.commands.author.spec import open_spec
from spin_usd.commands.author.views import ComposedTarget, look_notes, read_composed_target
from spin_usd.errors import GeometryError, InputError, StageError, UnsupportedError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.faults import reading
from spin_usd.files.model_root import model_roots
from spin_usd.formats.chosen_frames import chosen_frames, slice_of
from spin_usd.formats.mesh.mesh_bounds import mesh_bounds
from spin_usd.formats.mesh.mesh_file import MESHES
from spin_usd.geometry.camera import Camera
from spin_usd.labels.table import DEFAULT_LABELS, PIXEL_LABELS
from spin_usd.progress import Progress, no_progress
from spin_usd.renderers.embree.face_findings import face_findings
from spin_usd.sampling.poses import PoseLaw
from spin_usd.sampling.trajectory import TrajectoryLaw
from spin_usd.scene.derived.view_text import sentences
from spin_usd.scene.finding import Finding, in_sentences
from spin_usd.scene.poses import PoseList
from spin_usd.scene.source_bounds import SourceBounds
from spin_usd.stage.augment.sampled_values import SampledValues, overlaid
from spin_usd.stage.augment.sun_and_planet import write_sampled
from spin_usd.stage.author.camera_layer import lens_of
from spin_usd.stage.author.presets import Preset
from spin_usd.stage.author.source_bounds import box_corners, hull_corners, target_notes, usd_bounds
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.author.write_stage import ROOT, write_stage
from spin_usd.stage.check.every_picture import Shapes
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.new_folder import new_folder

OUTPUTS = {"image": "color3f"} | {name: PIXEL_LABELS[name].usd_type for name in DEFAULT_LABELS}
"""The files of a picture that an authored stage lists, each with the USD type of its pixels."""


def author_stage(
    *,
    poses: str | Path,
    out: str | Path,
    frames: str | None = None,
    additions: Mapping[str, Any] = MappingProxyType({}),
    progress: Progress = no_progress,
    **choices: Any,
) -> AuthorReport:
    """Write the stage of a pose list into the new folder `out`. `choices` are those of Choices, `additions` those of
    read_additions; `frames` is "A:B:STEP".

    Raises InputError for what cannot be accepted, OutputError when it cannot be written; then `out` is not there.
    """
    with reading(poses):
        listed = read_pose_list(poses)
    chosen = chosen_frames(listed, frames)
    wanted = Choices(**choices, additions=read_additions(**additions))
    files = {"poses": Path(poses)}
    return _author(wanted, Path(out), files, frames, len(listed), lambda camera, asset: chosen, progress=progress)


def author_sample(
    *,
    sample: str | Path,
    out: str | Path,
    count: int | None = None,
    frames: str | None = None,
    seed: int = 0,
    additions: Mapping[str, Any] = MappingProxyType({}),
    progress: Progress = no_progress,
    **choices: Any,
) -> AuthorReport:
    """Write a stage of sampled pictures into the new folder `out`: `sample` is a specification's name, its file, or its
    text; `count` of its pictures, all unless given, and of those what `frames`, "A:B:STEP", chooses. `choices` are
    those of Choices, and stand instead of the specification's; `additions` are those of read_additions.

    Raises as author_stage.
    """
    found = open_spec(sample, count)
    made = part_pictures(found, count)
    chosen = _chosen(made, frames)
    own = {name: getattr(found.table, name) for name in ("target", "camera", "lights", "environment")}
    own["preset"] = found.preset
    given = own | {name: value for name, value in choices.items() if value is not None}
    if missing := next((name for name in ("target", "camera") if given[name] is None), None):
        raise InputError(f"names no {missing}", where=found.source, do=f"give {missing} too")

    def pictures(camera: Camera, asset: TargetAsset) -> PoseList:
        framed = any(picture.part.law.inside for picture in chosen)  # nothing else asks for the hull
        hull = hull_corners(asset) if framed else box_corners(asset)
        return sample_poses(chosen, seed, camera, hull, found.source, progress)

    def light(stage: Any) -> SampledValues:
        return sample_light(stage, chosen, seed, found.table.constraints)

    wanted = Choices(
        seed=seed, sample=None if found.file else str(sample), **given, additions=read_additions(**additions)
    )
    files = {"sample": found.file} if found.file else {}
    laws = [picture.part.law for picture in chosen]
    return _author(wanted, Path(out), files, frames, len(made), pictures, light, laws, progress=progress)


def _chosen(made: tuple[PartPicture, ...], frames: str | None) -> tuple[PartPicture, ...]:
    chosen = made if frames is None else made[slice_of(frames)]
    if not chosen:
        raise InputError(f"frames {frames!r} chooses none of {len(made)} pictures")
    return chosen


def _author(
    choices: Choices,
    out: Path,
    files: Mapping[str, Path],
    frames: str | None,
    whole: int,
    pictures: Callable[[Camera, TargetAsset], PoseList],
    light: Callable[[Any], SampledValues] | None = None,
    laws: Sequence[PoseLaw | TrajectoryLaw] | None = None,
    *,
    progress: Progress,
) -> AuthorReport:
    """Write the stage into the new folder `out`.

    `files` are those that the pictures come from, and `frames` is what it chooses of the `whole` number; `pictures`
    gives the poses for a lens and a target; `light` gives what is sampled for the opened stage; `laws` are those that
    each of the poses was sampled from.
    """
    sources = open_sources(choices, files)
    models = (sources.target_file, *(body.file for body in sources.others))
    with model_roots(models, Path(choices.root) if choices.root else None), new_folder(out) as folder:
        units, time = choices.units_per_metre, choices.model_time
        asset, notes = write_model(sources.target_file, folder, units, choices.prim, time, selections(choices.variant))
        notes += axes_note(sources.target_file, asset, "poses are meant in these")
        notes += _unused(sources.preset, asset, selections(choices.variant))
        corners, lens = box_corners(asset), lens_of(sources.cameras.layer)
        unit = model_unit(sources.target_file, asset, choices.units_per_metre)
        if light is not None and not choices.any_size:
            refuse_size(corners, unit)  # poses are sampled for it, and would never have all of it in the picture
        poses = pictures(lens, asset)
        notes += (*_lists_note(poses), *poses.notes)
        write_stage(
            folder,
            poses=poses,
            target=asset,
            camera=sources.cameras.layer,
            camera_name=sources.cameras.name,
            further=sources.cameras.further,
            origin=sources.origin,
            seed=choices.seed,
            outputs=OUTPUTS,
            preset=sources.preset,
            surroundings=sources.surroundings,
        )
        authored = AuthoredPictures(
            target=asset, poses=poses, camera=lens, laws=laws, frames=frames, whole=whole, seed=choices.seed
        )
        any_size = choices.any_size
        notes += write_others(sources.others, folder, authored, units, any_size=any_size, progress=progress)
        notes += target_notes(open_stage(folder / ROOT))
        notes += choices.additions.write(folder / ROOT, [each.name for each in sources.cameras.further])
        _write_light(folder / ROOT, len(poses), light, choices.additions)
        composed, remarks = _composed_target(folder, poses, sources, asset, choices)
        hull = composed.mesh.hull
        if not choices.any_size:
            refuse_implausible(hull, unit, lens, poses)
        camera_file = sources.cameras.files["camera"]
        camera_notes = (*sources.cameras.notes, *_colour_notes(camera_file, composed, choices.additions))
        notes += notes_on_far_keypoints(choices.additions.keypoints, hull)
        if choices.augment is not None:
            augment_stage(stage=folder / ROOT, spec=choices.augment, progress=progress)
    return AuthorReport(
        root=str(out / ROOT),
        frames=len(poses),
        target=asset.name,
        meshes=asset.gprims,
        camera=camera_file.name,
        views=composed.views,
        notes=(*camera_notes, *sources.map_notes, *notes, *remarks),
    )


def _write_light(root: Path, frames: int, light: Callable[[Any], SampledValues] | None, additions: Additions) -> None:
    """Write what is sampled of the light of the stage at `root`, and over it where the Sun was asked to stand."""
    if light is None and not additions.turn_sun:
        return
    stage = open_stage(root)
    sampled, sun = light(stage) if light else None, additions.sun(stage)
    both = overlaid(sun, sampled) if sun and sampled else sun or sampled
    if both is not None:
        write_sampled(root, both, frames)


def _composed_target(
    folder: Path,
    poses: PoseList,
    sources: Sources,
    asset: TargetAsset,
    choices: Choices,
) -> tuple[ComposedTarget, tuple[str, ...]]:
    """Return what the pictures of the stage in `folder` show, and notes on that and on the target. Raises as
    check_written, and what a render of the stage would raise."""
    selected = sources.preset.chosen(asset.variants) if sources.preset else {}
    selected = {**selections(choices.variant), **selected}
    try:
        reader = StageReader(folder / ROOT)
        units, at_rest = choices.units_per_metre, choices.model_time is None
        notes = check_written(reader, sources.target_file, asset, units, selected, at_rest=at_rest)
        if any(map(is_users, (sources.target_file, *(body.file for body in sources.others)))):
            notes += tuple(in_sentences(_coincident(reader)))
        composed = read_composed_target(reader, poses)
    except (StageError, UnsupportedError, GeometryError) as refused:
        where = str(refused.where).replace(f"{folder}/", "") if refused.where else None  # the folder will be gone
        raise type(refused)(refused.found.replace(f"{folder}/", ""), where=where, do=refused.do) from None
    return composed, (*notes, *sentences(composed.views))


def _coincident(reader: StageReader) -> Iterator[Finding]:
    """Yield a finding for each of the first picture's bodies whose faces lie in one another."""
    shapes = Shapes(face_findings)
    for body in reader.scene(reader.frames[0]).bodies:
        yield from shapes.findings(body.target)


def _lists_note(poses: PoseList) -> tuple[str, ...]:
    """Return a note on which lists of a folder the poses are from, () for those of a file."""
    return (f"{poses.source}: read {poses.lists}",) if poses.lists else ()


def _unused(preset: Preset | None, target: TargetAsset, asked: Mapping[str, str]) -> tuple[str, ...]:
    """Return a note for each selection of the preset that the target has no variant set for, and for each of those
    `asked` that the preset's own replaces."""
    if preset is None:
        return ()
    missing = [name for name in preset.selections if name not in target.variants]
    notes = [f"the target has no variant set '{name}', so its materials stay as they are" for name in missing]
    for name, variant in preset.chosen(target.variants).items():
        if asked.get(name, variant) != variant:
            instead = f"the preset {preset.file.stem} selects {name}={variant}, in place of --variant"
            notes.append(f"{instead} {name}={asked[name]}: leave one of them out")
    return tuple(notes)


def _colour_notes(camera: Path, composed: ComposedTarget, additions: Additions) -> tuple[str, ...]:
    """Return a note where the target has colours and the camera's file does not say that it sees them."""
    if composed.grey and camera.suffix.lower() in CALIBRATIONS and not additions.channels:
        return (f"{camera.name} says nothing of colour: pictures are grey; --channels rgb has colour",)
    return ()


def check_written(
    reader: StageReader,
    file: Path,
    asset: TargetAsset,
    units_per_metre: float | None,
    selections: Mapping[str, str],
    *,
    at_rest: bool = True,
) -> tuple[str, ...]:
    """Return notes on the target that the stage of the `reader` has from the model `file`, with variants `selections`;
    `at_rest`: whether it stands as the file stores it.

    Raises InputError when its size is another than the file's, StageError or UnsupportedError as a render would.
    """
    time_code = reader.frames[0].time_code
    target = reader.target_at(time_code)
    notes = (*in_sentences(reader.notes), *look_notes(reader))
    if file.suffix.lower() in MESHES:
        source = mesh_bounds(file, units_per_metre) if at_rest else None
    else:
        metres = asset.metres_per_unit
        source = usd_bounds(file, asset.source_prim, metres_per_unit=metres, selections=selections, time_code=time_code)
    if source is None:
        return ("the target's size could not be compared with its file's: no other reader opens it", *notes)
    seen = all(finding.code != "material-transparent" for finding in reader.notes)
    _refuse_another_size(file, target.mesh.box if seen else reader.whole_target_at(time_code).mesh.box, source)
    return notes


def _refuse_another_size(file: Path, written: Float, source: SourceBounds) -> None:
    if source.agree_with(written):
        return
    found = f"is {_size(source.whole)} in its own file, but {_size(written)} in the stage, which was not kept"
    raise InputError(found, where=file, do="this is a defect of spin_usd: report it with the file")


def _size(box: Float) -> str:
    """Say how long the box's edges are and where it lies, so that two boxes of one size differ."""
    edges = " x ".join(f"{edge:.6g}" for edge in box[1] - box[0])
    return f"{edges} m around ({', '.join(f'{x:.6g}' for x in box.mean(0))})"
