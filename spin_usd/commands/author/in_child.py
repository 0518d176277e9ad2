"""`spin-usd author`: pose list or sampling specification + model + camera -> a layered stage."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from spin_usd.basics.arrays import Float
from spin_usd.basics.progress import Progress, no_progress
from spin_usd.commands.author.asked_pictures import AskedPictures, asked_pictures
from spin_usd.commands.author.augment import augment_stage
from spin_usd.commands.author.authoring import Authoring
from spin_usd.commands.author.craft_files import CraftTurns, with_craft
from spin_usd.commands.author.looks import give_materials
from spin_usd.commands.author.model import axes_note, model_unit, write_model
from spin_usd.commands.author.options import AuthorOptions, listed
from spin_usd.commands.author.other_bodies import write_others
from spin_usd.commands.author.plausible_target import not_framed, refuse_size
from spin_usd.commands.author.reports import AuthorReport
from spin_usd.commands.author.sources import open_sources
from spin_usd.commands.author.written_target import colour_notes, read_written_target
from spin_usd.errors import InputError, NotFramedError
from spin_usd.files.model_root import model_roots
from spin_usd.labels.table import DEFAULT_LABELS, PIXEL_LABELS
from spin_usd.scene.derived.view_text import sentences
from spin_usd.stage.augment.sun_and_planet import has_sun
from spin_usd.stage.author.poses_layer import author_clock
from spin_usd.stage.author.source_bounds import box_corners, hull_corners, target_notes
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.author.targets_in_turn import add_targets_in_turn
from spin_usd.stage.author.write_stage import ROOT, write_stage
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.store.new_folder import new_folder

MANY = 10  # sampled pictures: fewer are a trial
OUTPUTS = {"image": "color3f"} | {name: PIXEL_LABELS[name].usd_type for name in DEFAULT_LABELS}
"""The files of a picture that an authored stage lists, each with the USD type of its pixels."""


def author_stage(*, progress: Progress = no_progress, **given: Any) -> AuthorReport:
    """Write the stage of the options `given`, AuthorOptions, into a new folder.

    Raises InputError for invalid input, OutputError if it cannot be written; then the folder does not exist.
    """
    options, pictures = asked_pictures(AuthorOptions(**given), progress)
    with TemporaryDirectory(prefix="spin_usd-") as crafts:
        return _author(options, pictures, Path(crafts), progress)


def _author(options: AuthorOptions, pictures: AskedPictures, crafts: Path, progress: Progress) -> AuthorReport:
    given = str(options.target)
    options, turns = with_craft(options, crafts, pictures.sequences, progress)
    sources = open_sources(options, pictures.files)
    out, models_root = Path(options.out), Path(options.root) if options.root else None
    with model_roots(sources.models, models_root), new_folder(out) as folder:
        making = Authoring(
            options=options,
            pictures=pictures,
            sources=sources,
            crafts=crafts,
            given=given,
            turns=turns,
            folder=folder,
            progress=progress,
        )
        root = folder / ROOT
        _write_target(making)
        _place_target(making)
        shown = f"{len(turns.names)} craft, shown in turn" if turns else ""
        write_stage(folder, sources.stage, poses=making.poses, target=making.target, outputs=OUTPUTS, shown=shown)
        write_others(making)
        if turns:
            add_targets_in_turn(root, _crafts(making, turns), making.poses, turns.shown, _selections(making))
        added = sources.additions.write(root, [each.name for each in sources.stage.further], making.model_materials)
        sources.additions.write_light(root, len(making.poses), pictures.light)
        if making.poses.times is not None:
            author_clock(root, making.poses.times)
        stage = open_stage(root)
        making.notes += (*target_notes(stage), *added, *_same_in_all(making, stage))
        remarks = read_written_target(making)
        if options.augment is not None:
            augment_stage(stage=root, spec=str(options.augment), progress=progress)
    views, of_camera = making.composed.views, (*sources.camera_notes, *colour_notes(making), *sources.map_notes)
    return AuthorReport(
        root=str(out / ROOT),
        frames=len(making.poses),
        target=making.target.name,
        meshes=making.target.gprims,
        camera=sources.camera_file.name,
        views=views,
        notes=(*of_camera, *making.notes, *remarks, *sentences(views)),
        sizes=turns.sizes if turns else {},
    )


def _write_target(making: Authoring) -> None:
    """Write the target's model into the stage."""
    options, sources = making.options, making.sources
    file, units = sources.target_file, options.units_per_metre
    leaves, chosen = listed(options.leave_out), (options.prim, options.model_time, sources.variants)
    try:
        making.target, notes = write_model(file, making.folder, units, *chosen, leaves)
    except InputError as error:
        if not file.is_relative_to(making.crafts):
            raise
        raise type(error)(error.found, where=making.given, do=error.do) from None  # its file is none of the user's
    if making.turns:
        making.target = replace(making.target, name=making.turns.names[0])
    making.unit = model_unit(file, making.target, units)
    making.notes += notes
    making.notes += axes_note(file, making.target, "poses are meant in these", crafts=making.crafts)
    give_materials(making)
    making.notes += _unused(making)


def _place_target(making: Authoring) -> None:
    """Find the target's poses."""
    if making.pictures.light is not None and not making.options.any_size:
        # poses are sampled for it, and would never have all of it in the picture
        refuse_size(box_corners(making.target), making.unit)
    try:
        poses = making.poses = making.pictures.poses(making.sources.lens, partial(_corners, making))
    except NotFramedError as error:
        raise not_framed(error, box_corners(making.target), making.unit) from None
    if poses.lists:
        making.notes.append(f"{poses.source}: read {poses.lists}")
    making.notes += poses.notes


def _corners(making: Authoring, whole: bool) -> Sequence[Float]:
    """Return for each picture corners (N, 3) of the target that it shows, as Corners has them."""
    if making.turns:
        return [making.turns.hulls[name] for name in making.turns.shown]
    corners = hull_corners(making.target) if whole else box_corners(making.target)
    return [corners] * len(making.pictures.sequences)


def _crafts(making: Authoring, turns: CraftTurns) -> list[TargetAsset]:
    """Return the craft in turn, root prims of one layer of which the target is the first."""
    return [replace(making.target, name=name, prim=f"/{name}") for name in turns.names]


def _selections(making: Authoring) -> dict[str, str]:
    """Return the variants of the target that are selected by their sets: a preset's replace the requested ones."""
    preset = making.sources.stage.preset
    return {**making.sources.variants, **(preset.chosen(making.target.variants) if preset else {})}


def _unused(making: Authoring) -> Iterator[str]:
    """Yield a note for each selection of the preset without a variant set in the target, and for each requested
    selection that the preset replaces."""
    preset, asked = making.sources.stage.preset, making.sources.variants
    if preset is None:
        return
    for name, variant in preset.selections.items():
        if name not in making.target.variants:
            yield f"the target has no variant set '{name}', so its materials stay unchanged"
        elif variant not in (known := making.target.variants[name]):
            lacks = f"the preset {preset.file.stem} selects {name}={variant}, which the target lacks"
            yield f"{lacks}: its own stays (of {', '.join(known)})"
    for name, variant in preset.chosen(making.target.variants).items():
        if asked.get(name, variant) != variant:
            instead = f"the preset {preset.file.stem} selects {name}={variant}, in place of --variant"
            yield f"{instead} {name}={asked[name]}: leave one of them out"


def _same_in_all(making: Authoring, stage: Any) -> Iterator[str]:
    """Yield notes on what many sampled pictures have in common that users expect to differ."""
    pictures, count = making.pictures, len(making.poses)
    if pictures.light is None or pictures.laws is None or count < MANY:
        return
    if pictures.drawn_once:
        what = " and ".join(pictures.drawn_once)
        be = "is" if len(pictures.drawn_once) == 1 else "are"
        yield f'{what} {be} drawn once for all {count} pictures of a part: per = "frame" draws another value in each'
    drawn = any(each.startswith("sun.") for each in (*pictures.drawn, *pictures.drawn_once))
    if has_sun(stage) and not making.sources.additions.sun and not drawn:
        yield f"all {count} pictures have the same Sun: sun.direction=uniform in --sample draws another in each"


def author_requested(request: dict[str, Any], progress: Progress) -> AuthorReport:
    """Write the stage of a request, AuthorOptions as JSON."""
    return author_stage(progress=progress, **request)
