"""Whatever stands where in a glTF file's JSON: it is read, or refused in one sentence. The values are of all of JSON's
types, so no list of mistakes that somebody thought of is the judge."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.files.size_limits import GLTF_ENTRIES, MAX_UNSTORED
from spin_usd.formats.mesh.gltf_json import parsed_object
from spin_usd.formats.mesh.mesh_bounds import mesh_bounds
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.scene.asset import MAX_PARTS
from tests.formats.mesh.conftest import SQUARE, GltfWriter, png, uri

VALUES: tuple[Any, ...] = (
    None, True, 7, -1, 2**31, 10**400, 0.5, float("nan"), "text", "\0", [], [7], [{}], {}, {"name": 7},
)  # fmt: skip
DAMAGED = "export the model again"


def everything(gltf: GltfWriter) -> dict[str, Any]:
    """A glTF file that holds about all that is read."""
    info = {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": {"rotation": 1, "offset": [0, 0]}}}
    path = gltf(
        {
            "NORMAL": np.tile(np.array([0, 0, 1], np.float32), (4, 1)),
            "COLOR_0": np.full((4, 4), 0.5, np.float32),
            "JOINTS_0": np.zeros((4, 4), np.uint8),
            "WEIGHTS_0": np.tile(np.array([1, 0, 0, 0], np.float32), (4, 1)),
            "_MOVES": np.ones((2, 3), np.float32),
            "_TURNS": np.tile(np.array([0, 0, 0, 1], np.float32), (2, 1)),
            "_BINDS": np.eye(4, dtype=np.float32).reshape(1, 16)[:, :4],
            "_INDEX": np.array([3], np.uint8),
            "_VALUE": np.array([[7, 8, 9]], np.float32),
        },
        images=[{"uri": uri(png(np.zeros((2, 2, 3)))), "name": "picture"}],
        samplers=[{"wrapS": 33071, "magFilter": 9728}],
        textures=[{"source": 0, "sampler": 0}],
        materials=[
            {
                "name": "paint",
                "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicRoughnessTexture": info},
                "emissiveFactor": [1, 1, 1],
                "emissiveTexture": info,
                "normalTexture": {"index": 0, "scale": 0.5},
                "occlusionTexture": {"index": 0, "strength": 0.5},
                "alphaMode": "MASK",
                "alphaCutoff": 0.5,
                "extensions": {"KHR_materials_ior": {"ior": 1.3}, "KHR_materials_clearcoat": {"clearcoatFactor": 1}},
            }
        ],
        extensionsUsed=["KHR_materials_ior"],
        extensionsRequired=["KHR_texture_transform"],
        skins=[{"joints": [1]}],
        nodes=[
            {"mesh": 0, "skin": 0, "name": "panel", "children": [1]},
            {"translation": [1, 2, 3], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1], "children": [2, 3]},
            {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 6, "ROTATION": 7}}}},
            {"matrix": np.eye(4).ravel().tolist(), "extensions": {"KHR_node_visibility": {"visible": False}}},
        ],
    )
    document: dict[str, Any] = json.loads(path.read_text())
    at = document["meshes"][0]["primitives"][0]["attributes"]
    document["accessors"][at["POSITION"]]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": at["_INDEX"], "componentType": 5121},
        "values": {"bufferView": at["_VALUE"]},
    }
    return document


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The place of every value in a JSON value; of a list of numbers, of the first."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in entries:
        if isinstance(key, int) and key and isinstance(inner, int | float):
            return
        yield (*path, key)
        yield from places(inner, (*path, key))


@pytest.mark.parametrize("step", [pytest.param(1, marks=pytest.mark.slow), 5])
def test_every_value_of_every_other_type_is_read_or_refused_in_one_sentence(
    gltf: GltfWriter, tmp_path: Path, step: int
) -> None:
    """The quick one tries a fifth of the values at each place, others at the next."""
    document, path = everything(gltf), tmp_path / "changed.gltf"
    path.write_text(json.dumps(document))
    assert len(read_mesh_file(path).parts) == 2
    refused: list[str] = []
    for number, place in enumerate(places(document)):
        holder = document
        for key in place[:-1]:
            holder = holder[key]
        kept = holder[place[-1]]
        for value in VALUES[number % step :: step]:
            holder[place[-1]] = value
            path.write_text(json.dumps(document))
            try:
                read_mesh_file(path)
            except InputError as error:
                refused.append(str(error))
        holder[place[-1]] = kept
    assert len(refused) > 500 / step
    assert not [sentence for sentence in refused if "Error" in sentence or "NoneType" in sentence]


def test_a_material_whose_name_is_a_number_says_where(gltf: GltfWriter) -> None:
    with pytest.raises(InputError, match=r"model\.gltf: materials\[0\]\.name is 7, expected text; export") as caught:
        read_mesh_file(gltf(materials=[{"name": 7}]))
    assert caught.value.do == DAMAGED


@pytest.mark.parametrize("name", ["nodes", "meshes", "materials", "accessors"])
def test_lists_that_are_too_long_are_refused(gltf: GltfWriter, name: str) -> None:
    path = gltf(materials=[{}])
    document = json.loads(path.read_text())
    document[name] = [*document[name], *[{}] * GLTF_ENTRIES[name]][: GLTF_ENTRIES[name] + 1]
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=rf"has {GLTF_ENTRIES[name] + 1} {name}, more than"):
        read_mesh_file(path)


def test_parts_and_elements_are_counted_before_they_are_built(gltf: GltfWriter) -> None:
    document = json.loads((path := gltf()).read_text())
    document["nodes"] *= MAX_PARTS + 1
    document["scenes"][0]["nodes"] = list(range(MAX_PARTS + 1))
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=f"{MAX_PARTS + 1} parts"):
        read_mesh_file(path)
    unstored = {"componentType": 5126, "type": "VEC3", "count": MAX_UNSTORED + 1}
    document = json.loads((path := gltf()).read_text())
    document["accessors"][0] = unstored
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=f"{MAX_UNSTORED + 1} elements"):
        read_mesh_file(path)


def test_what_no_bytes_hold_and_other_counts_are_refused(gltf: GltfWriter) -> None:
    with pytest.raises(InputError, match=r"'panel' has 4 points and 3 values of NORMAL"):
        read_mesh_file(gltf({"NORMAL": SQUARE[:3]}))
    document = json.loads((path := gltf()).read_text())
    document["accessors"][0]["count"] = 5
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"accessors\[0\] reaches beyond the 48 bytes of bufferViews\[0\]"):
        read_mesh_file(path)
    assert mesh_bounds(path, None) is None


@pytest.mark.parametrize("text", [b"", b"[]", b"7", b"{", b"\xff", b'{"a": NaN', b"[" * 200])
def test_what_is_no_object_is_refused(tmp_path: Path, text: bytes) -> None:
    with pytest.raises(InputError, match=r"model\.gltf: is damaged"):
        parsed_object(text, tmp_path / "model.gltf")
