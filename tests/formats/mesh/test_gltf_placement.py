"""Where nodes, instances and joints put a mesh, by arithmetic on glTF 2.0's own formulas."""

from typing import Any

import numpy as np
import pytest

from spin_usd.basics.arrays import Float
from spin_usd.formats.mesh.mesh_bounds import mesh_bounds
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from tests.formats.mesh.conftest import SQUARE, GltfWriter, png

INSTANCING = "EXT_mesh_gpu_instancing"
TURN_Z = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]  # 90 degrees, x, y, z, w


def points_of(path: Any) -> Float:
    (part,) = read_mesh_file(path).parts
    return part.points


def instanced(attributes: dict[str, int]) -> dict[str, Any]:
    node = {"mesh": 0, "translation": [0, 0, 5], "extensions": {INSTANCING: {"attributes": attributes}}}
    return {"nodes": [node], "extensionsUsed": [INSTANCING], "extensionsRequired": [INSTANCING]}


def test_each_instance_stands_below_its_node(gltf: GltfWriter) -> None:
    """Its own transform comes first, then the node's. The two sets of rows lie in accessors 2 and 3, after the
    primitive's two, as attributes that no reader knows."""
    moves = np.array([[10, 0, 0], [0, 20, 0]], np.float32)
    turns = np.array([[0, 0, 0, 1], TURN_Z], np.float32)
    path = gltf({"_MOVES": moves, "_TURNS": turns}, **instanced({"TRANSLATION": 2, "ROTATION": 3}))
    turned = np.stack([-SQUARE[:, 1], SQUARE[:, 0], SQUARE[:, 2]], axis=1)
    expected = np.concatenate([SQUARE + np.array([10, 0, 5]), turned + np.array([0, 20, 5])])
    np.testing.assert_allclose(points_of(path), expected, atol=1e-6)
    assert mesh_bounds(path, None) is None, "trimesh draws one, and judges nothing here"


def test_a_skin_follows_its_joints_and_not_its_node(gltf: GltfWriter) -> None:
    """Half of the points follow one joint, half both alike."""
    joints = np.array([[0, 1, 0, 0]] * 4, np.uint8)
    weights = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0.5, 0.5, 0, 0], [0.5, 0.5, 0, 0]], np.float32)
    nodes = [
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"translation": [0, 0, 1], "children": [2]},
        {"translation": [0, 4, 0]},
    ]
    path = gltf(
        {"JOINTS_0": joints, "WEIGHTS_0": weights},
        nodes=nodes,
        skins=[{"joints": [1, 2]}],
        scenes=[{"nodes": [0, 1]}],
    )
    moved = np.array([[0, 0, 1], [0, 0, 1], [0, 2, 1], [0, 2, 1]])
    np.testing.assert_allclose(points_of(path), SQUARE + moved, atol=1e-6)
    assert mesh_bounds(path, None) is None, "trimesh moves it by its node"


def test_numbers_that_are_none_are_dropped_with_a_note(gltf: GltfWriter) -> None:
    normals = np.array([[0, 0, 1], [np.nan, 0, 1], [0, 0, 1], [0, 0, 1]], np.float32)
    colors = np.array([[1, 0, 0], [np.inf, 0, 0], [1, 0, 0], [1, 0, 0]], np.float32)
    asset = read_mesh_file(gltf({"NORMAL": normals, "COLOR_0": colors}))
    (part,) = asset.parts
    assert part.normals is not None
    assert np.isfinite(part.normals).all()
    assert "displayColor" not in part.primvars
    assert [note for note in asset.notes if "not numbers" in note] == [
        "normals of 'panel' that are not numbers: replaced by the normals of its faces",
        "displayColor of 'panel' holds values that are not numbers: dropped",
    ]


def test_coarser_levels_of_detail_are_left_out_even_where_the_scene_names_them(gltf: GltfWriter) -> None:
    node = {"mesh": 0, "name": "fine", "extensions": {"MSFT_lod": {"ids": [1]}}}
    coarse = {"mesh": 0, "name": "coarse", "scale": [2, 2, 2]}
    path = gltf({}, nodes=[node, coarse], scenes=[{"nodes": [0, 1]}], extensionsUsed=["MSFT_lod"])
    asset = read_mesh_file(path)
    assert [part.name for part in asset.parts] == ["fine"]
    assert "its coarser levels of detail (MSFT_lod) are left out" in asset.notes
    assert mesh_bounds(path, None) is None, "trimesh shows all levels"


@pytest.mark.parametrize(
    ("node", "mesh", "above", "name"),
    [
        ("NAUO1", "plate", "craft", "plate"),
        ("NAUO1", "=>[0:1:1:14]", "wing", "wing"),
        ("=>[0:1:1:14]", "=>[0:1:1:15]", "NAUO2", "model"),
        ("", "", "", "model"),
        ("cover", "plate", "craft", "cover"),
    ],
)
def test_names_that_open_cascade_makes_up_are_no_names(gltf: GltfWriter, node, mesh, above, name) -> None:
    """A product of several shapes has its name at the node above them."""
    path = gltf({}, nodes=[{"name": above, "children": [1]}, {"mesh": 0, "name": node}])
    text = path.read_text().replace('"name": "panel"', f'"name": "{mesh}"')
    path.write_text(text)
    assert [part.name for part in read_mesh_file(path).parts] == [name]


def test_the_names_of_variants_are_noted(gltf: GltfWriter) -> None:
    extension = {"KHR_materials_variants": {"variants": [{"name": "clean"}, {"name": "worn"}]}}
    notes = read_mesh_file(gltf({}, extensions=extension, extensionsUsed=[*extension])).notes
    assert any("clean, worn" in note for note in notes)


@pytest.mark.parametrize("file", ["a%20b.png", "a b.png"])
def test_a_percent_sign_in_a_files_own_name(gltf: GltfWriter, file: str) -> None:
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    path = gltf({}, materials=[material], textures=[{"source": 0}], images=[{"uri": "a%20b.png"}])
    (path.parent / file).write_bytes(png(np.zeros((2, 2, 3))))
    assert "diffuseColor" in read_mesh_file(path).materials[0].images
