"""Shapes of bodies: triangles, the measures in data sets, and PLY files.

The files are binary, in millimetres, as BOP's tools read them. Those know the number types float, double, int and
uchar, and faces of three corners alone. Source: `load_ply` in bop_toolkit's `inout.py`.
"""

import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import accumulate
from pathlib import Path

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.exchange.layout.exported_dataset import ExportedDataset
from spin_usd.files.folder import Folder
from spin_usd.processes.call import Call
from spin_usd.scene.derived.faces import parts_of
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import hull_points

CHUNK = 1 << 22  # distances worked out at once
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


class SaveModels(Struct, frozen=True, kw_only=True):
    """The request to save the targets of a stage."""

    stage: str
    folder: str
    frames: dict[str, list[str]]
    """Names of the frames that are looked at, by variant."""


SAVE_MODELS = Call("spin_usd.exchange.layout.save_models:save_models", SaveModels, list[int])


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """Triangles that represent a body in a data set."""

    points: Float
    """(P, 3) float64, body axes, metres."""
    faces: NDArray[np.int32]
    """(F, 3) of the points, counter-clockwise seen from outside."""
    face_part: NDArray[np.uint16]
    """(F,) part ids."""

    @classmethod
    def of(cls, mesh: Mesh) -> "Model":
        """Return the mesh with each of its instances in place, and without points that no face has."""
        pieces = list(mesh.placed)
        firsts = [0, *accumulate(len(points) for points, _ in pieces)]
        points = np.concatenate([points for points, _ in pieces])
        faces = np.concatenate([faces + first for (_, faces), first in zip(pieces, firsts, strict=False)])
        used, places = np.unique(faces, return_inverse=True)
        parts = parts_of(mesh, np.arange(mesh.count))
        return cls(points=points[used], faces=places.reshape(-1, 3).astype(np.int32), face_part=parts)

    @cached_property
    def hull(self) -> Float:
        """(N, 3) points whose convex hull is the model's."""
        return hull_points(self.points)


def diameter(points: Float) -> float:
    """Return the largest distance between two of the points (N, 3), comparing all pairs: give the convex hull's."""
    near = points - points.mean(0)  # far from the origin the products would cancel
    squares = (near**2).sum(1)
    step = max(CHUNK // len(near), 1)
    found = 0.0
    for start in range(0, len(near), step):
        chunk = slice(start, start + step)
        apart = squares[chunk, None] + squares - 2 * near[chunk] @ near.T
        one, other = np.unravel_index(int(np.argmax(apart)), apart.shape)
        found = max(found, float(np.linalg.norm(near[start + one] - near[other])))
    return found


def ply_bytes(model: Model) -> bytes:
    """Return the model's file: equal models have equal bytes."""
    faces = np.empty(len(model.faces), FACE)
    faces["count"], faces["corners"] = 3, model.faces
    header = HEADER.format(points=len(model.points), faces=len(faces)).encode("ascii")
    return header + (model.points * MILLIMETRES).astype("<f8").tobytes() + faces.tobytes()


@lru_cache(maxsize=1)
def body_models(dataset: ExportedDataset) -> dict[int, Model]:
    """Return the model of each target by its id, from the copy of the stage that the dataset holds. Raises StageError,
    UnsupportedError for a target that changes its shape."""
    frames: dict[str, list[str]] = defaultdict(list)
    for entry in dataset.entries:
        frames[entry.variant].append(entry.frame)
    stage = dataset.picture(0).picture.recorded.provenance.stage.root
    return read_models(Folder(dataset.dataset.root).path(stage), frames)


def read_models(root: Path, frames: Mapping[str, Sequence[str]]) -> dict[int, Model]:
    """Return the model of each target of the stage by its id, in the `frames`, their names by variant. Raises
    StageError, UnsupportedError for a target that changes its shape in them."""
    from spin_usd.processes.ask_child import ask_child  # not above: who only reads may have no system for children

    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        names = {variant: list(each) for variant, each in frames.items()}
        request = SaveModels(stage=str(root), folder=folder, frames=names)
        ids = ask_child(SAVE_MODELS, request, reads=root, writes=(Path(folder),))
        return {number: _loaded(Path(folder, f"{number}.npz")) for number in ids}


def _loaded(path: Path) -> Model:
    with np.load(path) as arrays:
        return Model(**arrays)
