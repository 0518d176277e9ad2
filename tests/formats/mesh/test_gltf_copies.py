"""Copies by EXT_mesh_gpu_instancing share one mesh, and stand where each alone would."""

import numpy as np
import pytest
import trimesh

from spin_usd.formats.mesh import gltf_file
from spin_usd.formats.mesh.gltf_placement import copies_of
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.scene.shape import MIN_SHARED_FACES
from spin_usd.stage.author.from_mesh_file import write_mesh_target
from spin_usd.stage.author.target_asset import describe
from spin_usd.stage.author.target_prim import composed_target
from tests.formats.mesh.test_gltf_placement import INSTANCING

FLOAT32 = 1e-6
BALL = trimesh.creation.icosphere(3, 0.5)
MOVES = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 1]], np.float32)
TURNS = np.array([[0, 0, 0, 1], [0.5, 0.5, 0.5, 0.5], [0, 0.6, 0, 0.8]], np.float32)
"""Quaternions x, y, z, w."""


def ball(gltf, scales, **node):
    """The file of a ball that is longer along x, copied three times."""
    points = (BALL.vertices * [2, 1, 1]).astype(np.float32)
    rows = {"_T": MOVES, "_R": TURNS, "_S": np.array(scales, np.float32)}
    attributes = {"TRANSLATION": 1, "ROTATION": 2, "SCALE": 3}
    return gltf(
        {"POSITION": np.asarray(points), "TEXCOORD_0": None, **rows},
        BALL.faces.astype(np.uint32).ravel(),
        nodes=[{"mesh": 0, "name": "ball", "extensions": {INSTANCING: {"attributes": attributes}}, **node}],
        extensionsUsed=[INSTANCING],
    )


def expected(scales, to_body):
    """The points (N, 3) of all copies, by trimesh's formulas."""
    placed = []
    for move, (x, y, z, w), scale in zip(MOVES, TURNS, scales, strict=True):
        matrix = trimesh.transformations.quaternion_matrix([w, x, y, z]) @ np.diag([*scale, 1])
        matrix[:3, 3] = move
        placed.append(trimesh.transform_points(BALL.vertices * [2, 1, 1], to_body @ matrix))
    return np.concatenate(placed)


@pytest.mark.parametrize(
    ("scales", "node", "shared"),
    [
        ([[1, 1, 1], [0.5, 0.5, 0.5], [2, 2, 2]], {"translation": [1, 2, 3], "scale": [2, 2, 2]}, True),
        ([[1, 2, 1]] * 3, {"rotation": [0, 0, 0.6, 0.8]}, True),
        ([[1, 1, 1], [1, 2, 1], [1, 1, 1]], {"rotation": [0, 0, 0.6, 0.8]}, False),
        ([[1, 1, 1], [-1, 1, 1], [1, 1, 1]], {}, False),
    ],
)
def test_copies_stand_in_the_stage_where_each_alone_would(tmp_path, gltf, scales, node, shared) -> None:
    """Ones that an instancer cannot place are faces of their own."""
    path = ball(gltf, scales, **node)
    asset = read_mesh_file(path)
    (part,) = asset.parts
    assert asset.faces == 3 * len(BALL.faces) > MIN_SHARED_FACES
    assert (part.copies is not None) == shared
    file = write_mesh_target(asset, tmp_path / "targets" / "ball", "ball")
    target = composed_target(describe(file, "ball"), tmp_path)
    assert [each.name for each in target.parts] == ["ball"]
    assert len(target.mesh.instances) == shared
    to_body = np.eye(4)
    if "rotation" in node:
        to_body = trimesh.transformations.quaternion_matrix([0.8, 0, 0, 0.6])
    to_body[:3, :3] *= node.get("scale", [1])[0]
    to_body[:3, 3] = node.get("translation", [0, 0, 0])
    theirs = expected(scales, to_body)
    ours = np.concatenate([points[np.unique(faces)] for points, faces in target.mesh.placed])
    assert np.allclose(np.sort(ours, axis=0), np.sort(theirs, axis=0), rtol=0, atol=20 * FLOAT32)
    assert np.allclose(target.mesh.box, [theirs.min(0), theirs.max(0)], atol=20 * FLOAT32)


def test_flattened_copies_are_not_shared() -> None:
    flat = np.stack([np.eye(4), np.diag([1, 1, 0, 1.0])])
    assert copies_of(flat) is None
    assert copies_of(flat[:1]) is not None


def test_many_faces_by_copies_are_told(gltf, monkeypatch) -> None:
    """Those of mirrored copies, which cannot share theirs."""
    monkeypatch.setattr(gltf_file, "MANY_FACES", 3000)
    plain, mirrored = [[1, 1, 1]] * 3, [[1, 1, 1], [-1, 1, 1], [1, 1, 1]]
    notes = [" ".join(read_mesh_file(ball(gltf, each)).notes) for each in (plain, mirrored)]
    assert ["3840 faces of 1280" in each for each in notes] == [False, True]
