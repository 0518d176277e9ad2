"""`spin-usd author`: pose list or example + model + camera -> a layered stage."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from spin_usd.arrays import Float
from spin_usd.dataset.author.additions import Additions, read_additions
from spin_usd.dataset.author.augment import augment_stage
from spin_usd.dataset.author.camera import USD_SUFFIXES, open_camera
from spin_usd.dataset.author.example import open_example
from spin_usd.dataset.author.example_pictures import ExamplePicture, draw_light, draw_poses, example_pictures
from spin_usd.dataset.author.far_keypoints import notes_on_far_keypoints
from spin_usd.dataset.author.plausible_target import ModelUnit, refuse_implausible, refuse_size
from spin_usd.dataset.author.reports import AuthorReport
from spin_usd.dataset.author.size import check_written
from spin_usd.dataset.author.views import Look, look_at
from spin_usd.dataset.store.new_folder import new_folder
from spin_usd.errors import GeometryError, InputError, StageError, UnsupportedError
from spin_usd.formats.chosen_frames import chosen_frames, slice_of
from spin_usd.formats.mesh.mesh_file import READERS, read_mesh_file
from spin_usd.formats.poses.read_pose_list import read_pose_list
from spin_usd.geometry.camera import Camera
from spin_usd.labels.table import DEFAULT_LABELS, LABELS
from spin_usd.resources import bundled
from spin_usd.scene.derived.view_text import sentences
from spin_usd.scene.source.poses import PoseList
from spin_usd.sha256 import sha256_of
from spin_usd.stage.augment.sampled_layer import write_sampled
from spin_usd.stage.augment.sampled_values import SampledValues, overlaid
from spin_usd.stage.author.camera_layer import lens_of
from spin_usd.stage.author.lights_and_environment import open_surroundings
from spin_usd.stage.author.presets import Preset, open_preset
from spin_usd.stage.author.provenance import Option, Origin
from spin_usd.stage.author.target.extent import box_corners
from spin_usd.stage.author.target.from_mesh_file import target_name, write_mesh_target
from spin_usd.stage.author.target.from_usd import copy_usd_target
from spin_usd.stage.author.target.target_asset import TargetAsset, describe
from spin_usd.stage.author.target_notes import target_notes
from spin_usd.stage.author.write_stage import ROOT, write_stage
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.stage_reader import StageReader

OUTPUTS = {"image": "color3f"} | {name: LABELS[name].usd_type for name in DEFAULT_LABELS}
"""The files of a picture that an authored stage lists, each with the USD type of its pixels."""


@dataclass(frozen=True, kw_only=True)
class Choices:
    """`target`, `camera`, `preset`, `lights`, `environment` and `augment` are names of what travels with spin_usd, or
    files; the lights and environment stand instead of the preset's. `augment`: a specification to write over it.
    `prim`: the path of what of a USD target is taken. `additions`: what is written over the stage before that.
    `any_size`: take a target of a size that no craft has, and one inside which the camera is."""

    target: str | Path
    camera: str | Path
    units_per_metre: float | None = None
    prim: str | None = None
    seed: int = 0
    preset: str | Path | None = None
    lights: str | Path | None = None
    environment: str | Path | None = None
    augment: str | None = None
    additions: Additions = Additions(files={})  # noqa: RUF009 - frozen
    any_size: bool = False


def author_stage(
    *,
    poses: str | Path,
    out: str | Path,
    frames: str | None = None,
    additions: Mapping[str, Any] = MappingProxyType({}),
    **choices: Any,
) -> AuthorReport:
    """Write the stage of a pose list into the new folder `out`. `choices` are those of Choices, `additions` those of
    read_additions; `frames` is "A:B:STEP".

    Raises InputError for what cannot be accepted, OutputError when it cannot be written; then `out` is not there.
    """
    chosen = chosen_frames(read_pose_list(poses), frames)
    wanted = Choices(**choices, additions=read_additions(**additions))
    return _author(wanted, Path(out), {"poses": Path(poses)}, lambda camera, corners: chosen)


def author_example(
    *,
    example: str | Path,
    out: str | Path,
    count: int | None = None,
    frames: str | None = None,
    seed: int = 0,
    additions: Mapping[str, Any] = MappingProxyType({}),
    **choices: Any,
) -> AuthorReport:
    """Write the stage of an example into the new folder `out`: `example` is one's name, or a file; `count` of its
    pictures, all unless given, and of those what `frames`, "A:B:STEP", chooses. `choices` are those of Choices, and
    stand instead of the example's; `additions` are those of read_additions.

    Raises as author_stage.
    """
    found = open_example(example)
    chosen = _chosen(example_pictures(found, count), frames)
    usual = {name: getattr(found, name) for name in ("target", "camera", "preset", "lights", "environment")}
    given = {name: value for name, value in choices.items() if value is not None}
    source = found.file.name

    def pictures(camera: Camera, corners: Float) -> PoseList:
        return draw_poses(chosen, seed, camera, corners, source)

    def light(stage: Any) -> SampledValues:
        return draw_light(stage, chosen, seed, found.constraints)

    wanted = Choices(seed=seed, **usual | given, additions=read_additions(**additions))
    return _author(wanted, Path(out), {"example": found.file}, pictures, light)


def _chosen(made: tuple[ExamplePicture, ...], frames: str | None) -> tuple[ExamplePicture, ...]:
    chosen = made if frames is None else made[slice_of(frames)]
    if not chosen:
        raise InputError(f"frames {frames!r} chooses none of {len(made)} pictures")
    return chosen


def _author(
    choices: Choices,
    out: Path,
    sources: Mapping[str, Path],
    pictures: Callable[[Camera, Float], PoseList],
    light: Callable[[Any], SampledValues] | None = None,
) -> AuthorReport:
    """`pictures` gives the poses for a lens and the corners (8, 3) of a target; `light` what is drawn for the opened
    stage. sources: the files they come from."""
    if not -(2**63) <= choices.seed < 2**63:
        raise InputError(f"seed {choices.seed} does not fit 64 bits")
    layer, camera_file, camera_notes = open_camera(str(choices.camera))
    target_file = _target_file(str(choices.target))
    files = {**sources, "target": target_file, "camera": camera_file}
    settings = _preset(str(choices.preset)) if choices.preset is not None else None
    if settings:
        files["preset"] = settings.file
    given_layers = {"lights": choices.lights, "environment": choices.environment}
    layers = {kind: _surroundings_file(str(given), kind) for kind, given in given_layers.items() if given is not None}
    files |= layers | dict(choices.additions.files)
    surroundings = {kind: open_surroundings(file, kind) for kind, file in layers.items()}
    inputs = {role: (file.name, sha256_of(file)) for role, file in files.items()}
    origin = Origin(inputs=inputs, options=_options(choices))
    with new_folder(out) as folder:
        asset, notes = _write_target(target_file, folder, choices.units_per_metre, choices.prim)
        notes += _unused(settings, asset)
        corners, lens = box_corners(asset), lens_of(layer)
        unit = _unit(choices, target_file, asset)
        if light is not None and not choices.any_size:
            refuse_size(corners, unit)  # poses are drawn for it, and would never have all of it in the picture
        poses = pictures(lens, corners)
        write_stage(
            folder,
            poses=poses,
            target=asset,
            camera=layer,
            origin=origin,
            seed=choices.seed,
            outputs=OUTPUTS,
            preset=settings,
            surroundings=surroundings,
        )
        notes += target_notes(open_stage(folder / ROOT))
        notes += choices.additions.write(folder / ROOT)
        _write_light(folder / ROOT, len(poses), light, choices.additions)
        selected = settings.chosen(asset.variants) if settings else {}
        look, remarks = _look(folder, poses, target_file, asset, choices.units_per_metre, selected)
        if not choices.any_size:
            refuse_implausible(look.mesh.hull if look else corners, unit, lens, poses)
        if look and look.grey and camera_file.suffix.lower() == ".json" and not choices.additions.channels:
            camera_notes += (
                f"{camera_file.name} says nothing of colour: pictures are grey; --channels rgb has colour",
            )
        notes += notes_on_far_keypoints(choices.additions.keypoints, look.mesh.hull if look else corners)
        if choices.augment is not None:
            augment_stage(stage=folder / ROOT, spec=choices.augment)
    return AuthorReport(
        root=str(out / ROOT),
        frames=len(poses),
        target=asset.name,
        meshes=asset.gprims,
        camera=camera_file.name,
        views=look.views if look else None,
        notes=(*camera_notes, *notes, *remarks),
    )


def _options(choices: Choices) -> dict[str, Option]:
    """Those that were given of what decides pictures beside the files, as `author`'s options are called."""
    options = {
        "seed": choices.seed,
        "units_per_metre": choices.units_per_metre,
        "prim": choices.prim,
        "channels": choices.additions.channels,
        "sun_direction": choices.additions.sun_from_camera,
        "sun_from_target": choices.additions.sun_from_target,
    }
    return {name: value for name, value in options.items() if value is not None}


def _write_light(root: Path, frames: int, light: Callable[[Any], SampledValues] | None, additions: Additions) -> None:
    """Write what is drawn of the light of the stage at `root`, and over it where the Sun was asked to stand."""
    if light is None and not additions.turn_sun:
        return
    stage = open_stage(root)
    drawn, sun = light(stage) if light else None, additions.sun(stage)
    both = overlaid(sun, drawn) if sun and drawn else sun or drawn
    if both is not None:
        write_sampled(root, both, frames)


def _look(
    folder: Path,
    poses: PoseList,
    file: Path,
    asset: TargetAsset,
    units_per_metre: float | None,
    selections: Mapping[str, str],
) -> tuple[Look | None, tuple[str, ...]]:
    """What the pictures of the stage in `folder` show, and notes on it and on the target; no look at one that a render
    will refuse. Raises as check_written."""
    notes: tuple[str, ...] = ()
    unknown = "the target's size could not be compared with its file's"
    try:
        reader = StageReader(folder / ROOT)
        notes = check_written(reader, file, asset, units_per_metre, selections)
        unknown = "what its pictures show is not known"
        look = look_at(reader, poses)
    except (StageError, UnsupportedError, GeometryError) as refused:
        reason = str(refused).replace(f"{folder}/", "")
        return None, (*notes, f"{unknown}, for it cannot be rendered: {reason}")
    return look, (*notes, *sentences(look.views))


def _unit(choices: Choices, file: Path, target: TargetAsset) -> ModelUnit:
    per_metre = choices.units_per_metre or 1 / target.metres_per_unit
    if file.suffix.lower() in READERS and choices.units_per_metre is None:
        per_metre = 1.0
    return ModelUnit(file=file, per_metre=per_metre, given=choices.units_per_metre is not None)


def _preset(given: str) -> Preset:
    """The preset of that name or in that file."""
    return open_preset(given if Path(given).suffix.lower() in USD_SUFFIXES else bundled("preset", given))


def _surroundings_file(given: str, kind: str) -> Path:
    """The layer of the lights or the environment of that name, or the file itself."""
    return Path(given) if Path(given).suffix.lower() in USD_SUFFIXES else bundled(kind, given)


def _unused(preset: Preset | None, target: TargetAsset) -> tuple[str, ...]:
    """A note for each selection of the preset that the target has no variant set for."""
    missing = [name for name in preset.selections if name not in target.variants] if preset else []
    return tuple(f"the target has no variant set '{name}', so its materials stay as they are" for name in missing)


def _target_file(given: str) -> Path:
    suffix = Path(given).suffix.lower()
    if suffix not in USD_SUFFIXES | set(READERS):
        if suffix or "/" in given:
            raise InputError("is no model file", where=given, do=f"give one of {', '.join(READERS)} or USD")
        return bundled("target", given)
    if not Path(given).is_file():
        raise InputError("is not there, or is not a file", where=given)
    return Path(given)


def _write_target(
    file: Path, folder: Path, units_per_metre: float | None, prim: str | None
) -> tuple[TargetAsset, tuple[str, ...]]:
    name = target_name(file.stem)
    place = folder / "targets" / name
    if file.suffix.lower() in USD_SUFFIXES:
        asset = copy_usd_target(file, place, name, units_per_metre, prim)
        return asset, asset.notes
    if prim is not None:
        raise InputError("--prim is given, and only USD files have prims", where=file, do="leave --prim out")
    model = read_mesh_file(file, units_per_metre)
    return describe(write_mesh_target(model, place, name), name), model.notes
