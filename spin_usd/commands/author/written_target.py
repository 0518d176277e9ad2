"""The target of a new stage, compared with its model's own file and with plausible values."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from spin_usd.basics.arrays import Float
from spin_usd.commands.author.authoring import Authoring
from spin_usd.commands.author.cameras import CALIBRATIONS
from spin_usd.commands.author.model import is_users
from spin_usd.commands.author.plausible_target import notes_on_far_keypoints, refuse_implausible
from spin_usd.commands.author.views import look_notes, read_composed_target, read_targets_in_turn
from spin_usd.errors import GeometryError, InputError, StageError, UnsupportedError
from spin_usd.formats.mesh.mesh_bounds import mesh_bounds
from spin_usd.formats.mesh.mesh_file import MESHES
from spin_usd.renderers.embree.face_findings import face_findings
from spin_usd.scene.finding import Finding, in_sentences
from spin_usd.scene.source_bounds import SourceBounds
from spin_usd.stage.author.source_bounds import usd_bounds
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.author.write_stage import ROOT
from spin_usd.stage.check.every_picture import Shapes
from spin_usd.stage.read.stage_reader import StageReader


def read_written_target(making: Authoring) -> tuple[str, ...]:
    """Read the target that the written stage composes into `making`, and return notes on it. Raises like check_written
    and like a render of the stage, and InputError for an implausible target."""
    options, sources = making.options, making.sources
    of_preset = sources.stage.preset.chosen(making.target.variants) if sources.stage.preset else {}
    selected = {**sources.variants, **of_preset}
    try:
        reader = StageReader(making.folder / ROOT)
        units, at_rest = options.units_per_metre, options.model_time is None
        notes: tuple[str, ...] = ()
        if not making.turns:  # these are ours, and the first picture may show any of them
            notes = check_written(reader, sources.target_file, making.target, units, selected, at_rest=at_rest)
        if any(map(is_users, sources.models)):
            notes += tuple(in_sentences(_coincident(reader)))
        in_turn = making.turns is not None
        making.composed = (
            read_targets_in_turn(reader, making.progress) if in_turn else read_composed_target(reader, making.poses)
        )
    except (StageError, UnsupportedError, GeometryError) as refused:
        gone = f"{making.folder}/"
        where = str(refused.where).replace(gone, "") if refused.where else None
        raise type(refused)(refused.found.replace(gone, ""), where=where, do=refused.do) from None
    hull = making.composed.mesh.hull
    if not (options.any_size or making.turns):
        refuse_implausible(hull, making.unit, making.sources.lens, making.poses)
    making.notes += notes_on_far_keypoints(sources.additions.keypoints, hull)
    return notes


def _coincident(reader: StageReader) -> Iterator[Finding]:
    """Yield a finding for each of the first picture's bodies whose faces lie in one another."""
    shapes = Shapes(face_findings)
    for body in reader.scene(reader.frames[0]).bodies:
        yield from shapes.findings(body.target)


def colour_notes(making: Authoring) -> tuple[str, ...]:
    """Return a note if the target has colours and the camera's file does not state colour."""
    camera = making.sources.camera_file
    if making.composed.grey and camera.suffix.lower() in CALIBRATIONS and not making.options.channels:
        return (f"{camera.name} does not state colour: pictures are grey; --channels rgb makes them coloured",)
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
    target = reader.bodies.target_at(time_code)
    notes = (*in_sentences(reader.notes), *look_notes(reader))
    if file.suffix.lower() in MESHES:
        source = mesh_bounds(file, units_per_metre) if at_rest else None
    else:
        metres = asset.metres_per_unit
        source = usd_bounds(file, asset.source_prim, metres_per_unit=metres, selections=selections, time_code=time_code)
    if source is not None and asset.left_out:
        source = replace(source, polygons=None, exact=True)  # what is left lies within the whole
    if source is None:
        return ("the target's size could not be compared with its file's: no other reader opens it", *notes)
    seen = all(finding.code != "material-transparent" for finding in reader.notes)
    _refuse_another_size(file, target.mesh.box if seen else reader.bodies.whole_target_at(time_code).mesh.box, source)
    return notes


def _refuse_another_size(file: Path, written: Float, source: SourceBounds) -> None:
    if source.agree_with(written):
        return
    found = f"is {_size(source.whole)} in its own file, but {_size(written)} in the stage, which was not kept"
    raise InputError(found, where=file, do="this is a defect of spin_usd: report it with the file")


def _size(box: Float) -> str:
    """Return the box's edges and its place in words, so that two boxes of one size differ."""
    edges = " x ".join(f"{edge:.6g}" for edge in box[1] - box[0])
    return f"{edges} m around ({', '.join(f'{x:.6g}' for x in box.mean(0))})"
