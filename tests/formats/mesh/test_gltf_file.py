"""glTF: coordinates, materials and textures. Authorities: trimesh, and the words of the glTF 2.0 standard."""

import io
import json
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import pytest
import trimesh
from PIL import Image

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.scene.asset import ImageMap, ImageTransform, MeshAsset
from spin_usd.scene.material import PRESENCE
from spin_usd.scene.texture import Primvar
from tests.formats.mesh.conftest import COORDINATES, FACES, SQUARE, GltfWriter, png, uri

FLOAT32 = 1e-7  # relative, of numbers near one
PICTURE = png(np.arange(48).reshape(4, 4, 3) * 5)
TEXTURE: dict[str, Any] = {"images": [{"uri": uri(PICTURE)}], "textures": [{"source": 0}]}
BASE = {"name": "paint", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}


def images(asset: MeshAsset) -> dict[str, ImageMap]:
    (material,) = asset.materials
    return dict(material.images)


def placed(placement: ImageTransform, st: Float) -> Float:
    """UsdTransform2d in its own words: scaled, then turned counter-clockwise, then translated."""
    angle = np.radians(placement.rotation_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.asarray(st * placement.scale @ turn.T + placement.translation, float)


def test_trimesh_reads_the_same_coordinates_normals_and_image(tmp_path: Path) -> None:
    ball = trimesh.creation.uv_sphere(count=[6, 8])
    uv = np.random.default_rng(3).random((len(ball.vertices), 2))
    picture = Image.open(io.BytesIO(PICTURE))
    paint = trimesh.visual.material.PBRMaterial(name="paint", baseColorTexture=picture)
    ball.visual = trimesh.visual.TextureVisuals(uv=uv, material=paint)
    ball.export(tmp_path / "ball.glb", include_normals=True)
    theirs = next(iter(trimesh.load_scene(tmp_path / "ball.glb", process=False).geometry.values()))
    asset = read_mesh_file(tmp_path / "ball.glb")
    (part,) = asset.parts
    corners = theirs.faces.ravel()
    assert np.array_equal(part.points[part.face_indices], theirs.vertices[corners])
    assert np.allclose(part.primvars["st"], theirs.visual.uv[corners], rtol=0, atol=FLOAT32)
    assert part.normals is not None
    assert np.allclose(part.normals, theirs.vertex_normals[corners], rtol=0, atol=FLOAT32)
    image = images(asset)["diffuseColor"]
    assert (image.color_space, image.wrap, image.output) == ("sRGB", ("repeat", "repeat"), "rgb")
    decoded = Image.open(io.BytesIO(image.file.data))
    assert np.array_equal(np.array(decoded), np.array(theirs.visual.material.baseColorTexture))


@pytest.mark.parametrize(("kind", "largest"), [("uint8", 255), ("uint16", 65535)])
def test_quantised_coordinates_are_fractions_of_their_largest(gltf: GltfWriter, kind: str, largest: int) -> None:
    whole = (COORDINATES * largest).astype(kind)
    (part,) = read_mesh_file(gltf({"TEXCOORD_0": (whole, True)})).parts
    assert np.array_equal(part.primvars["st"], (COORDINATES * (1, -1) + (0, 1))[FACES])


def test_a_second_set_of_coordinates_is_a_primvar_of_its_own(gltf: GltfWriter) -> None:
    info = {"index": 0, "texCoord": 1}
    path = gltf(
        {"TEXCOORD_1": COORDINATES / 2}, materials=[{"emissiveTexture": info, "emissiveFactor": [1, 1, 1]}], **TEXTURE
    )
    asset = read_mesh_file(path)
    assert images(asset)["emissiveColor"].primvar == "st1"
    assert np.array_equal(asset.parts[0].primvars["st1"], (COORDINATES / 2 * (1, -1) + (0, 1))[FACES])


@pytest.mark.parametrize(("mode", "indices"), [(5, [0, 1, 3, 2]), (6, [0, 1, 2, 3]), (5, None), (6, None)])
def test_strips_and_fans_are_their_triangles(gltf: GltfWriter, mode: int, indices: list[int] | None) -> None:
    order = np.arange(4) if indices is None else np.array(indices)
    points = SQUARE[[0, 1, 3, 2]] if indices is None and mode == 5 else SQUARE
    (part,) = read_mesh_file(
        gltf({"POSITION": points}, None if indices is None else order.astype(np.uint16), mode)
    ).parts
    corners = part.points[part.face_indices].reshape(-1, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.array_equal(normals, [[0, 0, 1], [0, 0, 1]])  # both face the viewer, and cover the square


def test_a_sparse_accessor_replaces_some_values(gltf: GltfWriter) -> None:
    path = gltf({"_INDEX": np.array([3], np.uint8), "_VALUE": np.array([[7, 8, 9]], np.float32)})
    document = json.loads(path.read_text())
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    document["accessors"][attributes["POSITION"]]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": attributes["_INDEX"], "componentType": 5121},
        "values": {"bufferView": attributes["_VALUE"]},
    }
    path.write_text(json.dumps(document))
    (part,) = read_mesh_file(path).parts
    assert np.array_equal(part.points, [*SQUARE[:3], [7, 8, 9]])


def test_nodes_nest_and_scale(gltf: GltfWriter) -> None:
    path = gltf(nodes=[
        {"children": [1], "translation": [1, 2, 3], "rotation": [0, 0, 0.6, 0.8], "scale": [2, 1, 1]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
    ])  # fmt: skip
    theirs = trimesh.load_scene(path, process=False).to_mesh()
    assert np.allclose(read_mesh_file(path).parts[0].points, theirs.vertices, rtol=0, atol=1e-15 * 100)


def test_a_mesh_placed_twice_is_two_parts_named_alike_each_time(gltf: GltfWriter) -> None:
    path = gltf(scenes=[{"nodes": [0, 1]}], nodes=[{"mesh": 0, "name": "left"}, {"mesh": 0, "name": "right"}])
    document = json.loads(path.read_text())
    document["meshes"][0]["primitives"] *= 2
    path.write_text(json.dumps(document))
    for _ in range(2):
        assert [part.name for part in read_mesh_file(path).parts] == ["left", "left_1", "right", "right_1"]


def test_a_part_belongs_to_its_node_and_to_those_above_but_for_what_is_around_all(gltf: GltfWriter) -> None:
    nodes = [
        {"name": "Craft", "children": [1, 3]},
        {"name": "Array", "children": [2]},
        {"name": "Cells", "mesh": 0},
        {"name": "Bus", "mesh": 0},
    ]
    path = gltf(nodes=nodes)
    document = json.loads(path.read_text())
    document["meshes"][0]["primitives"] *= 2  # as a node of two materials has
    path.write_text(json.dumps(document))
    found = {part.name: part.groups for part in read_mesh_file(path).parts}
    assert found == {"Cells": ("Array",), "Cells_1": ("Array", "Cells"), "Bus": (), "Bus_1": ("Bus",)}


def test_a_part_is_called_after_its_node_and_after_its_mesh_where_that_has_no_name(gltf: GltfWriter) -> None:
    for node, names in ((("Bus",), ["Bus"]), ((None,), ["hull"])):
        path = gltf(nodes=[{"mesh": 0, **({"name": name} if name else {})} for name in node])
        document = json.loads(path.read_text())
        document["meshes"][0]["name"] = "hull"
        path.write_text(json.dumps(document))
        assert [part.name for part in read_mesh_file(path).parts] == names


def test_factors_multiply_and_channels_are_the_standards(gltf: GltfWriter) -> None:
    info = {"index": 0}
    material = {
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.25, 0.125, 0.75], "baseColorTexture": info,
            "metallicFactor": 0.5, "roughnessFactor": 0.25, "metallicRoughnessTexture": info,
        },
        "emissiveFactor": [1, 0.5, 0], "emissiveTexture": info,
        "occlusionTexture": {"index": 0, "strength": 0.25},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_ior": {"ior": 1.3}},
    }  # fmt: skip
    asset = read_mesh_file(gltf(materials=[material], **TEXTURE))
    found = images(asset)
    uses = {name: (image.output, image.color_space, image.scale, image.bias[0]) for name, image in found.items()}
    packed = (1.0, 0.25, 0.5, 1.0)
    assert uses == {
        "diffuseColor": ("rgb", "sRGB", (0.5, 0.25, 0.125, 0.75), 0),
        "roughness": ("g", "raw", packed, 0),
        "metallic": ("b", "raw", packed, 0),
        "emissiveColor": ("rgb", "sRGB", (4, 2, 0, 1), 0),
        "occlusion": ("r", "raw", (0.25,) * 4, 0.75),  # 1 + strength (texel - 1)
    }
    assert asset.materials[0].constants.ior == 1.3
    assert asset.notes == ()


def test_a_normal_texture_is_raw_and_scaled_before_it_is_normalised(gltf: GltfWriter) -> None:
    info = {"index": 0, "scale": 0.5}
    asset = read_mesh_file(gltf(materials=[{"normalTexture": info}], **TEXTURE))
    image = images(asset)["normal"]
    texel = np.array([0.8, 0.3, 0.9])
    assert image.color_space == "raw"
    assert np.allclose(texel * image.scale[:3] + image.bias[:3], (texel * 2 - 1) * (0.5, 0.5, 1), rtol=0, atol=1e-15)
    assert any("normalTexture" in note and "validator" in note for note in asset.notes)


@pytest.mark.parametrize(
    ("alpha", "opacity", "threshold", "mode", "has_image"),
    [
        ({}, 1, 0, "transparent", False),
        ({"alphaMode": "MASK"}, 0.75, 0.5, "transparent", True),
        ({"alphaMode": "MASK", "alphaCutoff": 0.25}, 0.75, 0.25, "transparent", True),
        ({"alphaMode": "MASK", "alphaCutoff": 0}, 1, 0, "transparent", False),
        ({"alphaMode": "MASK", "alphaCutoff": 2}, 0, 1, "transparent", False),
        ({"alphaMode": "BLEND"}, 0.75, 0, PRESENCE, True),
    ],
)
def test_alpha_modes(
    gltf: GltfWriter, alpha: dict[str, Any], opacity: float, threshold: float, mode: str, has_image: bool
) -> None:
    factors = {"baseColorFactor": [1, 1, 1, 0.75], "baseColorTexture": {"index": 0}}
    asset = read_mesh_file(gltf(materials=[{"pbrMetallicRoughness": factors} | alpha], **TEXTURE))
    constants = asset.materials[0].constants
    assert (constants.opacity, constants.opacity_threshold, constants.opacity_mode) == (opacity, threshold, mode)
    assert ("opacity" in images(asset)) == has_image
    assert not has_image or (images(asset)["opacity"].output, images(asset)["opacity"].scale[3]) == ("a", 0.75)


@pytest.mark.parametrize(("angle", "offset", "scale"), [
    (np.pi / 2, (0, 1), (0.5, 0.5)),  # the extension's own example: "the lower left quadrant"
    (0, (0, 0.5), (0.5, 0.5)),
])  # fmt: skip
def test_a_texture_transform_shows_the_lower_left_quadrant(
    gltf: GltfWriter, angle: float, offset: tuple[float, float], scale: tuple[float, float]
) -> None:
    move = {"rotation": angle, "offset": offset, "scale": scale}
    info = {"index": 0, "extensions": {"KHR_texture_transform": move}}
    asset = read_mesh_file(gltf(materials=[{"pbrMetallicRoughness": {"baseColorTexture": info}}], **TEXTURE))
    st = placed(images(asset)["diffuseColor"].placement, asset.parts[0].primvars["st"])
    assert np.allclose(st.min(0), (0, 0), rtol=0, atol=1e-15)
    assert np.allclose(st.max(0), (0.5, 0.5), rtol=0, atol=1e-15)


def test_a_texture_transform_turns_counter_clockwise_on_the_image(gltf: GltfWriter) -> None:
    """From the standard's words: scale, then turn, then offset, where u points right and v down."""
    angle, offset, scale = 0.3, np.array([0.1, 0.7]), np.array([2.0, 0.5])
    move = {"rotation": angle, "offset": list(offset), "scale": list(scale)}
    info = {"index": 0, "extensions": {"KHR_texture_transform": move}}
    asset = read_mesh_file(gltf(materials=[{"pbrMetallicRoughness": {"baseColorTexture": info}}], **TEXTURE))
    uv = COORDINATES[FACES].astype(float)
    seen = uv * scale * (1, -1)  # with v up, as one sees it
    turned = np.stack([seen @ (np.cos(angle), -np.sin(angle)), seen @ (np.sin(angle), np.cos(angle))], 1)
    expected = turned * (1, -1) + offset
    st = placed(images(asset)["diffuseColor"].placement, asset.parts[0].primvars["st"])
    assert np.allclose(st * (1, -1) + (0, 1), expected, rtol=0, atol=1e-15)


def test_samplers_wrap_each_axis(gltf: GltfWriter) -> None:
    sampler = {
        "samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}],
        "textures": [{"source": 0, "sampler": 0}],
    }
    asset = read_mesh_file(gltf(materials=[BASE], **TEXTURE | sampler))
    assert images(asset)["diffuseColor"].wrap == ("clamp", "mirror")
    assert any("nearest" in note for note in asset.notes)


def test_vertex_colours_multiply_the_base_colour(gltf: GltfWriter) -> None:
    colors = np.array([[255, 0, 0, 255], [0, 51, 0, 255], [0, 0, 255, 0], [255, 255, 255, 255]], np.uint8)
    factors = {"baseColorFactor": [0.5, 1, 1, 1]}
    asset = read_mesh_file(gltf({"COLOR_0": (colors, True)}, materials=[{"pbrMetallicRoughness": factors}]))
    assert asset.materials[0].constants.diffuse_color == Primvar(name="displayColor")
    expected = np.array([[0.5, 0, 0], [0, 0.2, 0], [0, 0, 1], [0.5, 1, 1]])[FACES]
    assert np.array_equal(asset.parts[0].primvars["displayColor"], expected)
    textured = read_mesh_file(gltf({"COLOR_0": (colors, True)}, materials=[BASE], **TEXTURE))
    assert any("vertex colours of 'panel'" in note for note in textured.notes)
    assert "diffuseColor" in images(textured)


@pytest.mark.parametrize(
    ("changed", "found"),
    [
        ({"images": [{"uri": "none.png"}]}, "'none.png' is missing"),
        ({"images": [{"uri": "../model.gltf"}]}, "outside the model's folder"),
        ({"images": [{"uri": "/etc/hostname"}]}, "outside the model's folder"),
        ({"images": [{"uri": "model.gltf"}]}, "is not a PNG"),
        ({"images": [{"uri": uri(PICTURE[:50])}]}, "is not a PNG"),
        ({"textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]}, "only there as KHR_texture_basisu"),
    ],
)
def test_a_texture_that_cannot_be_had_is_noted(gltf: GltfWriter, changed: dict[str, Any], found: str) -> None:
    asset = read_mesh_file(gltf(materials=[BASE], **TEXTURE | changed))
    assert images(asset) == {}
    assert any(found in note and "'paint'" in note and "baseColorTexture" in note for note in asset.notes)


def test_a_part_without_coordinates_keeps_the_factors(gltf: GltfWriter) -> None:
    asset = read_mesh_file(gltf({"TEXCOORD_0": None}, materials=[BASE], **TEXTURE))
    assert images(asset) == {}
    assert any("TEXCOORD_0" in note for note in asset.notes)


def test_extensions_are_named_or_refused(gltf: GltfWriter) -> None:
    asset = read_mesh_file(gltf(extensionsUsed=["KHR_materials_sheen", "KHR_materials_ior"]))
    assert [note for note in asset.notes if "extensions" in note] == [
        "glTF extensions that are not carried over: KHR_materials_sheen"
    ]
    asset = read_mesh_file(gltf(extensionsUsed=["KHR_lights_punctual"], extensionsRequired=["KHR_lights_punctual"]))
    assert any("KHR_lights_punctual" in note for note in asset.notes), "it moves nothing, required or not"
    for moving in ({"extensionsRequired": ["EXT_other"]}, {"extensionsUsed": ["CESIUM_RTC"]}):
        with pytest.raises(InputError, match=r"model\.gltf: needs the glTF extension (EXT_other|CESIUM_RTC)"):
            read_mesh_file(gltf(**moving))


@pytest.mark.parametrize("listed", ["extensionsUsed", "extensionsRequired"])
def test_draco_is_decompressed(gltf: GltfWriter, listed: str) -> None:
    """The accessors have no data of their own: without the decoder they are zeros, and no face has an area."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    tints = np.arange(3 * len(ball.vertices), dtype=np.uint8).reshape(-1, 3)
    data = DracoPy.encode(ball.vertices, ball.faces, quantization_bits=16, colors=tints, preserve_order=True)
    ids = {each["attribute_type"]: each["unique_id"] for each in DracoPy.decode(data).attributes}
    count = len(ball.vertices)
    primitive = {
        "attributes": {"POSITION": 0, "COLOR_0": 1},
        "indices": 2,
        "extensions": {
            "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": ids[0], "COLOR_0": ids[2]}}
        },
    }
    path = gltf(
        meshes=[{"name": "ball", "primitives": [primitive]}],
        accessors=[
            {"componentType": 5126, "count": count, "type": "VEC3"},
            {"componentType": 5121, "count": count, "type": "VEC3", "normalized": True},
            {"componentType": 5125, "count": ball.faces.size, "type": "SCALAR"},
        ],
        buffers=[{"uri": uri(data), "byteLength": len(data)}],
        bufferViews=[{"buffer": 0, "byteLength": len(data)}],
        **{listed: ["KHR_draco_mesh_compression"]},
    )
    asset = read_mesh_file(path)
    (part,) = asset.parts
    corners = ball.faces.ravel()
    assert np.allclose(part.points[part.face_indices], ball.vertices[corners], rtol=0, atol=2.0 / 2**16)
    assert np.allclose(part.primvars["displayColor"], tints[corners] / 255, rtol=0, atol=1e-15)
    assert asset.notes == ()


@pytest.mark.parametrize("emptied", ["POSITION", "indices"])
def test_a_mesh_without_faces_among_full_ones_is_noted(gltf: GltfWriter, emptied: str) -> None:
    document = json.loads((path := gltf()).read_text())
    empty = json.loads(json.dumps(document["meshes"][0] | {"name": "empty"}))
    primitive = empty["primitives"][0]
    (primitive["attributes"] if emptied == "POSITION" else primitive)[emptied] = len(document["accessors"])
    document["accessors"].append({"componentType": 5126, "count": 0, "type": "VEC3"})
    document["meshes"].append(empty)
    document["nodes"][0]["children"] = [1]
    document["nodes"].append({"mesh": 1})
    path.write_text(json.dumps(document))
    asset = read_mesh_file(path)
    assert [part.name for part in asset.parts] == ["panel"]
    assert asset.notes == ("'empty' has no faces and is skipped",)


def test_corners_that_make_no_triangle_are_left_out_with_a_note(gltf: GltfWriter) -> None:
    asset = read_mesh_file(gltf(indices=np.append(FACES, FACES[:2])))
    assert asset.faces == 2
    assert asset.notes == ("'panel' ends with 2 corners that make no triangle, which are skipped",)


def test_a_webp_image_becomes_png_without_loss(gltf: GltfWriter) -> None:
    data = io.BytesIO()
    Image.open(io.BytesIO(PICTURE)).save(data, "WEBP", lossless=True)
    texture = {
        "images": [{"uri": uri(data.getvalue())}],
        "textures": [{"extensions": {"EXT_texture_webp": {"source": 0}}}],
    }
    asset = read_mesh_file(gltf(materials=[BASE], extensionsRequired=["EXT_texture_webp"], **texture))
    file = images(asset)["diffuseColor"].file
    assert file.name.endswith(".png")
    assert np.array_equal(np.array(Image.open(io.BytesIO(file.data))), np.array(Image.open(io.BytesIO(PICTURE))))


@pytest.mark.parametrize(
    "changed",
    [
        {"nodes": [{"mesh": 0, "children": [0]}]},
        {"nodes": [{"mesh": -1}]},
        {"nodes": [{"mesh": 7}]},
        {"asset": {"version": "1.0"}},
        {"buffers": [{"uri": "../secret.bin", "byteLength": 48}]},
        {"bufferViews": [{"buffer": 0, "byteLength": 1000}]},
        {"meshes": [{"primitives": [{"attributes": {}}]}]},
    ],
)
def test_damaged_documents_are_refused(gltf: GltfWriter, changed: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"model\.gltf"):
        read_mesh_file(gltf(**changed))
