"""Pieces of the target put together: one mesh, its parts numbered."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.target import Part
from spin_usd.stage.parts import Labels
from spin_usd.stage.pieces import Piece


def assembled(pieces: list[Piece], labels: list[Labels], metres: float) -> tuple[Mesh, tuple[Part, ...]]:
    """One mesh of `pieces`, whose numbers of parts `labels` explains and whose unit is `metres`; and its parts,
    numbered from 1 in order of prim path. Parts without a face are left out."""
    part = np.concatenate([piece.part for piece in pieces])
    used = sorted(np.unique(part), key=lambda number: labels[number].part_path)
    ids = np.zeros(len(labels), np.int64)
    ids[used] = np.arange(1, len(used) + 1)
    first = np.cumsum([0, *(len(piece.triangles.points) for piece in pieces)])
    mesh = Mesh(
        points=np.concatenate([piece.triangles.points for piece in pieces]) * metres,
        faces=np.concatenate([piece.triangles.corners + n for piece, n in zip(pieces, first, strict=False)]),
        face_part=ids[part],
        face_group=np.concatenate([np.full(len(piece.part), piece.group, np.uint16) for piece in pieces]),
        face_material=np.concatenate([piece.material for piece in pieces]),
        corner_normals=np.concatenate([piece.triangles.normals for piece in pieces]),
        primvars=_primvars(pieces),
    )
    return mesh, tuple(_part(number, labels[place]) for number, place in enumerate(used, 1))


def _part(number: int, labels: Labels) -> Part:
    return Part(id=number, path=labels.part_path, name=labels.part_name, class_name=labels.part_class)


def _primvars(pieces: list[Piece]) -> dict[str, NDArray[np.float32]]:
    """(F, 3, C) by name, 0 on the pieces that lack one. Raises UnsupportedError for one name of two types."""
    channels: dict[str, int] = {}
    for name, values in (item for piece in pieces for item in piece.triangles.primvars.items()):
        if channels.setdefault(name, values.shape[2]) != values.shape[2]:
            found = f"primvars:{name} has {values.shape[2]} numbers on some of its gprims, {channels[name]} on others"
            raise UnsupportedError(found, do="give one of them another name")
    return {name: np.concatenate([_values(piece, name, count) for piece in pieces]) for name, count in channels.items()}


def _values(piece: Piece, name: str, channels: int) -> NDArray[np.float32]:
    """(T, 3, channels) of one primvar on one piece."""
    values = piece.triangles.primvars.get(name, np.zeros((1, 3, channels)))
    return np.broadcast_to(values, (len(piece.part), 3, channels)).astype(np.float32)
