"""STEP as GLB, by Open CASCADE (cascadio): faces within a tolerance of the curved surfaces, in metres, in the file's
own axes.

Open CASCADE is a large library in C++, so a child process alone calls it.
"""

from pathlib import Path

from spin_usd.basics.extras import EXTRAS
from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import read_bytes
from spin_usd.scene.converted_model import ConvertedModel, ModelToConvert

LINEAR, ANGULAR = 0.002, 0.2  # of edges' lengths, and radians between neighbouring faces: 32 to a circle


def convert_step(model: ModelToConvert) -> ConvertedModel:
    """Write a model as GLB. Raises InputError for a file that is not STEP, MissingPackageError without cascadio."""
    source = model.source
    EXTRAS["step"].require(source)
    import cascadio  # not above: it is an extra

    data = read_bytes(source, MAX_MODEL)
    with decoding(source):
        glb = cascadio.to_glb_bytes(
            data, tol_linear=LINEAR, tol_angular=ANGULAR, tol_relative=True, merge_primitives=True, use_parallel=False
        )
    if not glb:
        raise InputError("cannot be read as STEP", where=source, do="copy or export it again")
    Path(model.to).write_bytes(glb)
    return ConvertedModel()
