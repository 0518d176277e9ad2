"""Compare the target that `author` wrote, composed again and in metres, with what another reader finds in its file."""

from collections.abc import Mapping
from pathlib import Path

from spin_usd.arrays import Float
from spin_usd.dataset.author.views import look_notes
from spin_usd.errors import InputError
from spin_usd.formats.mesh.mesh_bounds import mesh_bounds
from spin_usd.formats.mesh.mesh_file import MESHES
from spin_usd.scene.finding import in_sentences
from spin_usd.scene.source.source_bounds import SourceBounds
from spin_usd.stage.author.target.source_bounds import usd_bounds
from spin_usd.stage.author.target.target_asset import TargetAsset
from spin_usd.stage.read.stage_reader import StageReader


def check_written(
    reader: StageReader,
    file: Path,
    asset: TargetAsset,
    units_per_metre: float | None,
    selections: Mapping[str, str],
) -> tuple[str, ...]:
    """Return notes on the target that the stage of the `reader` has from the model `file`, with variants `selections`.

    Raises InputError when its size is another than the file's, StageError or UnsupportedError as a render would.
    """
    time_code = reader.frames[0].time_code
    target = reader.target_at(time_code)
    notes = (*in_sentences(reader.notes), *look_notes(reader))
    if file.suffix.lower() in MESHES:
        source = mesh_bounds(file, units_per_metre)
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
