"""Models as binary PLY files of triangles in millimetres, as BOP's tools read them.

Those know the number types float, double, int and uchar, and faces of three corners alone. Source: `load_ply` in
bop_toolkit's `inout.py`.
"""

import numpy as np

from spin_usd.exchange.layout.model import Model

MILLIMETRES = 1000.0
HEADER = """ply
format binary_little_endian 1.0
comment millimetres, in the body's axes
element vertex {points}
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
end_header
"""
FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def ply_bytes(model: Model) -> bytes:
    """Return the model's file: equal models have equal bytes."""
    faces = np.empty(len(model.faces), FACE)
    faces["count"], faces["corners"] = 3, model.faces
    header = HEADER.format(points=len(model.points), faces=len(faces)).encode("ascii")
    return header + (model.points * MILLIMETRES).astype("<f8").tobytes() + faces.tobytes()
