"""STEP as GLB, by Open CASCADE (cascadio): faces within a tolerance of the curved surfaces, in metres, in the file's
own axes.

Open CASCADE is a large library in C++, so a child process alone calls it.
"""

from pathlib import Path

from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import read_bytes

LINEAR, ANGULAR = 0.002, 0.2  # of edges' lengths, and radians between neighbouring faces: 32 to a circle
INSTALL = "run pip install '.[step]' where spin_usd's source is, or convert it to GLB, as FreeCAD does"


def convert_step(*, source: str, to: str) -> dict[str, object]:
    """Write the model at `source` to the GLB `to`. Return the length of its unit in metres as "metres_per_unit", and
    "notes". Raises InputError for a file that is not STEP, and if cascadio is not installed."""
    try:
        import cascadio  # not above: it is an extra
    except ImportError:
        raise InputError("is STEP, which needs cascadio, which is not installed", where=source, do=INSTALL) from None
    data = read_bytes(source, MAX_MODEL)
    with decoding(source):
        glb = cascadio.to_glb_bytes(
            data, tol_linear=LINEAR, tol_angular=ANGULAR, tol_relative=True, merge_primitives=True, use_parallel=False
        )
    if not glb:
        raise InputError("cannot be read as STEP", where=source, do="copy or export it again")
    Path(to).write_bytes(glb)
    return {"metres_per_unit": 1.0, "notes": ()}
