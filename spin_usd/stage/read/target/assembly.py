"""The target's gprims assembled: one mesh; a shape with several instances is kept once."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.scene.instances import Instances
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import Shape
from spin_usd.stage.read.shapes.triangles import Int
from spin_usd.stage.read.target.body_parts import BodyParts
from spin_usd.stage.read.target.gprim import PlacedGprim
from spin_usd.stage.read.target.part_labels import Labels

# A shape with fewer triangles is copied for each instance: an instance costs a renderer more than so few triangles.
MIN_SHARED_FACES = 1000


def assembled(pieces: list[PlacedGprim], labels: list[Labels], metres: float, parts: BodyParts) -> Mesh:
    """Build one mesh of `pieces`. labels: of the pieces' part numbers · metres: the pieces' unit · parts: the body's,
    whose numbers the faces get."""
    ids = np.array([parts.numbers.get(each.part_key, 0) for each in labels])
    channels = _channels(pieces)
    alone, shared = _by_mesh(pieces)
    instances = tuple(_instances(each, ids, metres) for each in shared)
    joined = _joined(alone, ids, metres, channels)
    used = (each.parts[:, np.unique(each.shape.face_part)] for each in instances)
    numbered = joined["face_part"].all() and all(parts.all() for parts in used)
    assert numbered, "a face is of a part that has no number"
    return Mesh(**joined, instances=instances)


def _by_mesh(pieces: list[PlacedGprim]) -> tuple[list[PlacedGprim], list[list[PlacedGprim]]]:
    """Separate the single gprims from those that share mesh and materials with others."""
    alike: dict[Any, list[PlacedGprim]] = {}
    for piece in pieces:
        alike.setdefault((id(piece.mesh), piece.materials), []).append(piece)
    shared = {key: each for key, each in alike.items() if len(each) > 1 and len(each[0].mesh.part) >= MIN_SHARED_FACES}
    alone = [piece for piece in pieces if (id(piece.mesh), piece.materials) not in shared]
    return alone, list(shared.values())


def _joined(pieces: list[PlacedGprim], ids: Int, metres: float, channels: dict[str, int]) -> dict[str, Any]:
    """Build the fields of a Shape of all `pieces`, in the target's axes."""
    triangles = [piece.mesh.triangles.transformed(piece.matrix, piece.where) for piece in pieces]
    first = np.cumsum([0, *(len(each.points) for each in triangles)])
    return {
        "points": _stacked([each.points for each in triangles], (3,)) * metres,
        "faces": _stacked([each.corners + n for each, n in zip(triangles, first, strict=False)], (3,)),
        "face_part": _stacked([ids[list(piece.parts)][piece.mesh.part] for piece in pieces], ()),
        "face_group": _stacked([np.full(len(piece.mesh.part), piece.group) for piece in pieces], ()),
        "face_material": _stacked([np.array(piece.materials)[piece.mesh.material] for piece in pieces], ()),
        "corner_normals": _stacked([each.normals for each in triangles], (3, 3)),
        "primvars": {
            name: _stacked([_values(each.primvars, name, count, len(each.corners)) for each in triangles], (3, count))
            for name, count in channels.items()
        },
    }


def _stacked(arrays: Sequence[NDArray[Any]], shape: tuple[int, ...]) -> NDArray[Any]:
    """Concatenate the rows of `arrays` (N, *shape)."""
    return np.concatenate(arrays) if arrays else np.zeros((0, *shape))


def _instances(pieces: list[PlacedGprim], ids: Int, metres: float) -> Instances:
    """Turn `pieces`, which have the same mesh and materials, into instances of one shape."""
    mesh, triangles = pieces[0].mesh, pieces[0].mesh.triangles
    shape = Shape(
        points=triangles.points,
        faces=triangles.corners.astype(np.int32),
        face_part=mesh.part.astype(np.uint16),
        face_material=np.array(pieces[0].materials, np.int32)[mesh.material],
        corner_normals=triangles.normals.astype(np.float32),
        primvars={name: values.astype(np.float32) for name, values in triangles.primvars.items()},
    )
    return Instances(
        shape=shape,
        matrices=np.stack([piece.matrix[:, :3].T for piece in pieces]) * metres,
        parts=ids[np.array([piece.parts for piece in pieces])].astype(np.uint16),
        groups=np.array([piece.group for piece in pieces], np.uint16),
    )


def _channels(pieces: list[PlacedGprim]) -> dict[str, int]:
    """Count the numbers of each primvar. Raises UnsupportedError for one name of two types."""
    channels: dict[str, int] = {}
    for name, values in (item for piece in pieces for item in piece.mesh.triangles.primvars.items()):
        if channels.setdefault(name, values.shape[2]) != values.shape[2]:
            found = f"primvars:{name} has {values.shape[2]} numbers on some of its gprims, {channels[name]} on others"
            raise UnsupportedError(found, do="give one of them another name")
    return channels


def _values(primvars: Any, name: str, channels: int, count: int) -> NDArray[np.float32]:
    """Return the values (count, 3, channels) of one primvar of a gprim: 0 where it lacks it."""
    values = primvars.get(name, np.zeros((1, 3, channels)))
    return np.broadcast_to(values, (count, 3, channels)).astype(np.float32)
