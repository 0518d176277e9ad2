"""The other reader of mesh files agrees with ours wherever it answers: what author refuses is then a defect of ours."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spin_usd.basics.arrays import Float
from spin_usd.formats.mesh.mesh_bounds import mesh_bounds
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from tests.formats.mesh.conftest import FACES, SQUARE, GltfWriter

TWO = [{"mesh": 0, "name": "x", "translation": [50, 0, 0]}, {"mesh": 0, "name": "x", "translation": [0, 7, 0]}]


def box(path: Path) -> Float:
    points = np.concatenate([part.points[part.face_indices] for part in read_mesh_file(path).parts])
    return np.stack([points.min(0), points.max(0)])


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"scenes": [{"nodes": [0, 1]}], "nodes": TWO},
        {"scenes": [{"nodes": [0]}, {"nodes": [1]}], "scene": 1, "nodes": TWO},
        {"nodes": [{"mesh": 0, "rotation": [0, 0, 1.2, 1.6]}]},
        {"nodes": [{"mesh": 0, "scale": [2, -2, 2], "children": [1]}, {"mesh": 0, "translation": [0, 0, 4]}]},
        {"nodes": [{"mesh": 0, "matrix": [0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 3, 4, 5, 1]}]},
    ],
)
def test_both_readers_place_a_gltfs_meshes_alike(gltf: GltfWriter, changed: dict[str, Any]) -> None:
    path = gltf(**changed)
    theirs = mesh_bounds(path, None)
    assert theirs is not None
    assert np.allclose(theirs.whole, box(path), rtol=0, atol=1e-6)


@pytest.mark.parametrize(("indices", "mode"), [(FACES, 4), ([0, 1, 3, 2], 5), ([0, 1, 2, 3], 6)])
@pytest.mark.parametrize(
    "points",
    [
        SQUARE,
        (np.round(SQUARE * 1000).astype(np.int16), False),
        (np.round(SQUARE * 16384).astype(np.int16), True),
        (np.round(SQUARE * 128).astype(np.uint8), True),
    ],
)
def test_what_the_other_reader_spoils_it_is_not_asked(gltf: GltfWriter, points: Any, indices: Any, mode: int) -> None:
    """trimesh leaves normalised positions whole numbers, and refuses fans."""
    path = gltf({"POSITION": points}, np.array(indices, np.uint16), mode)
    theirs = mesh_bounds(path, None)
    assert theirs is None or np.allclose(theirs.whole, box(path), rtol=0, atol=1e-6)
    assert (theirs is None) == (mode == 6 or (isinstance(points, tuple) and points[1]))
