"""Nodes that vary over a surface: textures, transforms, primvar readers; the specification and USD as authorities."""

import re

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdShade, UsdUtils

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.derived.lookup import values_at
from spin_usd.scene.texture import Coordinates, Primvar, Texture
from spin_usd.stage.author.from_usd import copy_usd_target
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd.shader_inputs import read_constant
from tests.cases.png import png

FLOAT32 = 1e-6
# 2 x 2, the top row first: red, green / blue, white.
PIXELS = np.array([[[255, 0, 0, 255], [0, 255, 0, 128]], [[0, 0, 255, 64], [255, 255, 255, 0]]])
STAGE = """
    def Mesh "Square" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        rel material:binding = </World/Target/Paint>
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        uniform token subdivisionScheme = "none"
        {primvars}
    }}
    def Material "Paint"
    {{
        {interface}
        token outputs:surface.connect = </World/Target/Paint/Surface.outputs:surface>
        def Shader "Surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            {inputs}
            token outputs:surface
        }}
        def Shader "Texture"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./a.png@
            token inputs:sourceColorSpace = "raw"
            float2 inputs:st.connect = </World/Target/Paint/{st}.outputs:result>
            {texture}
            float outputs:a
            float outputs:r
            float3 outputs:rgb
        }}
        def Shader "Reader"
        {{
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            {reader}
            float2 outputs:result
        }}
        {nodes}
    }}"""
ST = 'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (\ninterpolation = "vertex"\n)'
RGB = "color3f inputs:diffuseColor.connect = </World/Target/Paint/Texture.outputs:rgb>"


@pytest.fixture
def read_target(read_scene, tmp_path):
    """The target of a square with `parts` of its material's text replaced."""
    (tmp_path / "a.png").write_bytes(png(PIXELS, color=6))

    def read(inputs=RGB, *, primvars=ST, st="Reader", name="stage.usda", texture="", interface="", reader="", nodes=""):
        text = STAGE.format(
            inputs=inputs, primvars=primvars, st=st, texture=texture, interface=interface, reader=reader, nodes=nodes
        )
        return read_scene(text, name=name).bodies[0].target

    return read


def shown(target, value, points):
    """`value` at `points` (N, 2) of the unit square."""
    mesh = target.mesh
    corners = mesh.points[mesh.faces][..., :2]
    result = []
    for point in np.atleast_2d(points):
        for face, (a, b, c) in enumerate(corners):
            u, v = np.linalg.solve(np.stack([b - a, c - a], 1), point - a)
            if min(u, v, 1 - u - v) >= -1e-9:
                result.append(values_at(value, mesh, np.array([face]), np.array([[1 - u - v, u, v]]))[0])
                break
    return np.array(result)


def test_the_first_row_of_an_image_is_at_t_1(read_target) -> None:
    target = read_target()
    found = shown(target, target.materials[0].diffuse_color, [(0.25, 0.75), (0.75, 0.75), (0.25, 0.25), (0.75, 0.25)])
    np.testing.assert_allclose(found, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], atol=FLOAT32)


def test_scale_bias_and_single_outputs(read_target) -> None:
    target = read_target(
        """float inputs:opacity.connect = </World/Target/Paint/Texture.outputs:a>
        float inputs:roughness.connect = </World/Target/Paint/Texture.outputs:r>""",
        texture="float4 inputs:scale = (0.5, 1, 1, 0.5)\nfloat4 inputs:bias = (0.25, 0, 0, 0.25)",
    )
    material = target.materials[0]
    np.testing.assert_allclose(shown(target, material.roughness, [(0.25, 0.75), (0.75, 0.75)])[:, 0], [0.75, 0.25])
    alpha = np.array([255, 128]) / 255 * 0.5 + 0.25
    np.testing.assert_allclose(shown(target, material.opacity, [(0.25, 0.75), (0.75, 0.75)])[:, 0], alpha, atol=FLOAT32)


def test_a_texture_that_leaves_what_the_input_can_be_is_refused(read_target) -> None:
    saying = (
        r"^/World/Target/Paint/Surface: its diffuseColor is 2, by /World/Target/Paint/Texture; keep it between 0 and 1"
    )
    with pytest.raises(StageError, match=saying):
        read_target(texture="float4 inputs:scale = (1, 2, 1, 1)")


@pytest.mark.parametrize("wrap", ["repeat", "mirror", "clamp", "black"])
def test_wrap_modes(read_target, wrap) -> None:
    """st runs from -1 to 2, so the middle third is the image; s wraps, t is clamped."""
    wide = ST.replace("(0, 0), (1, 0), (1, 1), (0, 1)", "(-1, -1), (2, -1), (2, 2), (-1, 2)")
    target = read_target(primvars=wide, texture=f'token inputs:wrapS = "{wrap}"\ntoken inputs:wrapT = "clamp"')
    s = np.array([-0.75, -0.25, 0.25, 0.75, 1.25, 1.75])
    found = shown(target, target.materials[0].diffuse_color, np.stack([(s + 1) / 3, 0 * s + 1.75 / 3], 1))
    r, g, k = [1, 0, 0], [0, 1, 0], [0, 0, 0]
    expected = {"repeat": [r, g] * 3, "mirror": [g, r, r, g, g, r], "clamp": [r, r, r, g, g, g]}
    np.testing.assert_allclose(found, expected.get(wrap, [k, k, r, g, k, k]), atol=FLOAT32)


def test_without_a_wrap_mode_an_image_ends_in_black(read_target) -> None:
    """The default is useMetadata, and a PNG file has none."""
    assert read_target().materials[0].diffuse_color.wrap == ("black", "black")


TRANSFORM = """def Shader "{name}"
        {{
            uniform token info:id = "UsdTransform2d"
            float2 inputs:in.connect = </World/Target/Paint/{source}.outputs:result>
            float inputs:rotation = {rotation}
            float2 inputs:scale = {scale}
            float2 inputs:translation = {translation}
            float2 outputs:result
        }}
"""


def test_transforms_scale_then_rotate_counter_clockwise_then_translate(read_target) -> None:
    """Source: the specification: in * scale * rotate + translation. And a chain is one after the other."""
    first = TRANSFORM.format(name="T1", source="Reader", rotation=90, scale=(2, 3), translation=(10, 20))
    matrix = read_target(st="T1", nodes=first).materials[0].diffuse_color.coordinates.matrix
    np.testing.assert_allclose(matrix, [0, -3, 10, 2, 0, 20], atol=FLOAT32)  # (1, 0) -> (2, 0) -> (0, 2) -> (10, 22)
    second = TRANSFORM.format(name="T2", source="T1", rotation=0, scale=(0.5, 1), translation=(-1, 0))
    both = read_target(st="T2", nodes=first + second, name="b.usda").materials[0].diffuse_color.coordinates.matrix
    np.testing.assert_allclose(both, [0, -1.5, 4, 2, 0, 20], atol=FLOAT32)


def test_the_readers_fallback_where_the_gprim_lacks_the_primvar(read_target) -> None:
    target = read_target(primvars="", reader="float2 inputs:fallback = (0.25, 0.75)")
    texture = target.materials[0].diffuse_color
    assert texture.coordinates == Coordinates(primvar=None, constant=(0.25, 0.75))
    assert not target.mesh.primvars
    np.testing.assert_allclose(shown(target, texture, [(0.9, 0.1)]), [[1, 0, 0]], atol=FLOAT32)


def test_one_material_on_gprims_with_and_without_its_primvar_is_two(read_scene, tmp_path) -> None:
    (tmp_path / "a.png").write_bytes(png(PIXELS, color=6))
    text = STAGE.format(inputs=RGB, primvars=ST, st="Reader", texture="", interface="", reader="", nodes="")
    mesh = text[: text.index("def Material")]
    bare = mesh.replace("Square", "Bare").replace(ST, "")
    target = read_scene(mesh + bare + text[text.index("def Material") :]).bodies[0].target
    assert [m.diffuse_color.coordinates.primvar for m in target.materials] == ["st", None]
    assert target.materials[0].diffuse_color.image == target.materials[1].diffuse_color.image
    np.testing.assert_array_equal(target.mesh.primvars["st"][2:], 0)  # of the square without it


def test_varname_through_the_interface(read_target) -> None:
    target = read_target(
        interface='string inputs:uv = "map1"',
        primvars=ST.replace("primvars:st", "primvars:map1"),
        reader="string inputs:varname.connect = </World/Target/Paint.inputs:uv>",
        name="a.usda",
    )
    assert target.materials[0].diffuse_color.coordinates.primvar == "map1"
    assert set(target.mesh.primvars) == {"map1"}


def test_primvar_readers_of_numbers_and_colors(read_target) -> None:
    nodes = """def Shader "Rough"
        {
            uniform token info:id = "UsdPrimvarReader_float"
            string inputs:varname = "rough"
            float inputs:fallback = 0.75
            float outputs:result
        }
        def Shader "Color"
        {
            uniform token info:id = "UsdPrimvarReader_float3"
            string inputs:varname = "tint"
            float3 outputs:result
        }"""
    inputs = """float inputs:roughness.connect = </World/Target/Paint/Rough.outputs:result>
        color3f inputs:diffuseColor.connect = </World/Target/Paint/Color.outputs:result>"""
    tint = 'color3f[] primvars:tint = [(0.2, 0.4, 0.6), (0.6, 0.4, 0.2)] (\ninterpolation = "vertex"\n)\n'
    target = read_target(inputs, nodes=nodes, primvars=tint + "int[] primvars:tint:indices = [0, 1, 1, 0]")
    material = target.materials[0]
    assert material.roughness == 0.75
    assert material.diffuse_color == Primvar(name="tint")
    found = shown(target, material.diffuse_color, [(0.25, 0.5)])
    np.testing.assert_allclose(found, [[0.3, 0.4, 0.5]], atol=FLOAT32)


def test_an_interface_of_a_node_graph(read_target) -> None:
    graph = """def NodeGraph "Graph"
        {
            color3f outputs:out.connect = </World/Target/Paint/Graph/Inner.outputs:rgb>
            asset inputs:picture = @./a.png@
            def Shader "Inner"
            {
                uniform token info:id = "UsdUVTexture"
                asset inputs:file.connect = </World/Target/Paint/Graph.inputs:picture>
                float3 outputs:rgb
            }
        }"""
    texture = read_target(RGB.replace("Texture.outputs:rgb", "Graph.outputs:out"), nodes=graph).materials[0]
    assert texture.diffuse_color.path == "/World/Target/Paint/Graph/Inner"
    assert texture.diffuse_color.coordinates == Coordinates(primvar=None)


def test_the_fallback_counts_where_no_file_is_authored_or_none_is_there(read_target) -> None:
    bare = "float4 inputs:fallback = (0.25, 0.5, 0.75, 1)\nfloat4 inputs:scale = (9, 9, 9, 9)"
    text = f"asset inputs:file = @@\n{bare}"
    target = read_target(texture=text)
    assert target.materials[0].diffuse_color == (0.25, 0.5, 0.75)
    with pytest.raises(StageError, match=r"^/World/Target/Paint/Missing: its image @./none.png@ does not exist"):
        read_target(MISSING_RGB, nodes=MISSING, name="b.usda")
    own = MISSING.replace("float3 outputs", "float4 inputs:fallback = (1, 0, 0, 1)\nfloat3 outputs")
    assert read_target(MISSING_RGB, nodes=own, name="c.usda").materials[0].diffuse_color == (1, 0, 0)


MISSING = 'def Shader "Missing"\n{\nuniform token info:id = "UsdUVTexture"\nasset inputs:file = @./none.png@\n'
MISSING += "float3 outputs:rgb\n}"
MISSING_RGB = RGB.replace("Texture.outputs", "Missing.outputs")


def test_a_normal_map(read_target) -> None:
    texture = "float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)"
    inputs = "normal3f inputs:normal.connect = </World/Target/Paint/Texture.outputs:rgb>"
    normal = read_target(inputs, texture=texture).materials[0].normal
    assert isinstance(normal, Texture)
    assert normal.scale == (2, 2, 2, 1)
    assert normal.bias == (-1, -1, -1, 0)


CYCLE = TRANSFORM.format(name="T1", source="T2", rotation=0, scale=(1, 1), translation=(0, 0)) + TRANSFORM.format(
    name="T2", source="T1", rotation=0, scale=(1, 1), translation=(0, 0)
)
MATERIALX = 'def Shader "Noise"\n{\nuniform token info:id = "ND_noise2d_color3"\nfloat3 outputs:out\n}'


@pytest.mark.parametrize(
    ("options", "error", "saying"),
    [
        ({"st": "T1", "nodes": CYCLE}, StageError, "/T[12].inputs:in: is connected to itself"),
        (
            {"inputs": RGB.replace("Texture.outputs:rgb", "Noise.outputs:out"), "nodes": MATERIALX},
            UnsupportedError,
            "/Surface.inputs:diffuseColor: is connected to .*/Noise, which is 'ND_noise2d_color3'",
        ),
        (
            {"inputs": RGB.replace("outputs:rgb", "outputs:a")},
            StageError,
            "/Surface.inputs:diffuseColor: needs 3 and is connected to .*/Texture.outputs:a of 1 numbers",
        ),
        ({"inputs": "float inputs:diffuseColor = 1"}, StageError, "/Surface.inputs:diffuseColor: is 1.0, expected 3"),
        (
            {"inputs": "int inputs:useSpecularWorkflow.connect = </World/Target/Paint/Texture.outputs:r>"},
            UnsupportedError,
            "/Surface.inputs:useSpecularWorkflow: is connected to .*/Texture; author a constant",
        ),
        ({"texture": 'token inputs:wrapS = "roll"'}, UnsupportedError, "/Texture.inputs:wrapS: is 'roll'"),
        ({"texture": 'token inputs:isSRGB = "yes"'}, UnsupportedError, "/Texture.inputs:isSRGB: is 'yes'"),
        (
            {"interface": "token outputs:volume.connect = </World/Target/Paint/Reader.outputs:result>"},
            UnsupportedError,
            ": its volume is made by",
        ),
        ({"inputs": 'token inputs:opacityMode = "glass"'}, UnsupportedError, "/Surface.inputs:opacityMode: is 'glass'"),
    ],
)
def test_what_cannot_be_shown_right_is_refused_by_name(read_target, options, error, saying) -> None:
    with pytest.raises(error, match=f"^/World/Target/Paint{saying}"):
        read_target(**options)


def test_a_primvar_of_another_type_or_count_is_as_good_as_none(read_target) -> None:
    """As Hydra has it."""
    without = read_target(primvars="").materials
    for kind, values in (("float", "0, 1, 1, 0"), ("texCoord3f", "(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)")):
        primvars = f'{kind}[] primvars:st = [{values}] (\ninterpolation = "vertex"\n)'
        assert read_target(primvars=primvars).materials == without
    assert (
        read_target(primvars='texCoord2f[] primvars:st = [(0, 1)] (\ninterpolation = "vertex"\n)').materials == without
    )


def test_a_color_space_that_usd_does_not_name(read_target) -> None:
    with pytest.raises(UnsupportedError, match=re.escape("/Missing.inputs:sourceColorSpace: is 'ACEScg'")):
        read_target(MISSING_RGB, nodes=MISSING.replace("none.png@", 'a.png@\ntoken inputs:sourceColorSpace = "ACEScg"'))


def test_a_texel_decides_the_hash_and_the_look_but_not_the_geometry(read_target, tmp_path) -> None:
    before = read_target()
    reader = StageReader(tmp_path / "stage.usda")
    assert "a.png" in reader.used_files
    assert reader.stage_hash
    (tmp_path / "a.png").write_bytes(png(PIXELS // 2, color=6))
    changed = StageReader(tmp_path / "stage.usda")
    after = changed.scene(changed.frames[0]).bodies[0].target
    assert changed.stage_hash != reader.stage_hash
    assert changed.used_files["a.png"] != reader.used_files["a.png"]
    assert after.materials[0].key != before.materials[0].key
    assert after.mesh.key == before.mesh.key
    assert after.mesh.shading_key == before.mesh.shading_key


TILED = "asset inputs:file = @./tiles/a.<UDIM>.png@"


@pytest.fixture
def tiled(make_stage, tmp_path):
    """The path of a stage whose square spans 2 x 2 tiles, of which there are 1001 (as a.png) and 1012 (turned)."""
    (tmp_path / "tiles").mkdir()
    (tmp_path / "tiles/a.1001.png").write_bytes(png(PIXELS, color=6))
    (tmp_path / "tiles/a.1012.png").write_bytes(png(PIXELS[::-1], color=6))
    wide = ST.replace("(0, 0), (1, 0), (1, 1), (0, 1)", "(0, 0), (2, 0), (2, 2), (0, 2)")
    text = STAGE.format(inputs=RGB, primvars=wide, st="Reader", texture="", interface="", reader="", nodes="")
    return make_stage(text.replace("asset inputs:file = @./a.png@", TILED))


def test_tiles_lie_where_their_numbers_say(tiled) -> None:
    reader = StageReader(tiled)
    target = reader.scene(reader.frames[0]).bodies[0].target
    points = [(0.125, 0.375), (0.375, 0.375), (0.625, 0.875), (0.875, 0.875), (0.75, 0.25), (0.25, 0.75)]
    found = shown(target, target.materials[0].diffuse_color, points)
    red, green, blue, white, nothing = [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [0, 0, 0]
    np.testing.assert_allclose(found, [red, green, blue, white, nothing, nothing], atol=FLOAT32)
    assert {"tiles/a.1001.png", "tiles/a.1012.png"} <= set(reader.used_files)


def test_a_changed_tile_is_another_stage(tiled, tmp_path) -> None:
    before = StageReader(tiled).stage_hash
    (tmp_path / "tiles/a.1012.png").write_bytes(png(PIXELS, color=6))
    assert StageReader(tiled).stage_hash != before


def test_tiles_travel_with_a_model_and_in_a_package(tiled, tmp_path) -> None:
    """The stage in a sub-folder refers to a copy of the one at hand, then to a package of it."""
    model = Usd.Stage.Open(str(tiled))
    model.GetPrimAtPath("/World/Target").RemoveAppliedSchema("SpinTargetAPI")
    model.RemovePrim("/World/Camera")
    model.Export(str(tmp_path / "model.usda"))
    exported = (tmp_path / "model.usda").read_text()
    (tmp_path / "model.usda").write_text(exported.replace(f"@{tmp_path}/", "@./"))  # flattened paths are absolute
    assert UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(tmp_path / "model.usda")), str(tmp_path / "model.usdz"))
    colors = []
    for number, suffix in enumerate(("usda", "usdz")):
        asset = copy_usd_target(tmp_path / f"model.{suffix}", tmp_path / "copies" / str(number), "model", None)
        stage = Usd.Stage.CreateNew(str(tmp_path / f"stage{number}.usda"))
        stage.DefinePrim("/M").GetReferences().AddReference(str(asset.file))
        shader = UsdShade.Shader(stage.GetPrimAtPath("/M/Target/Paint/Texture"))
        tiles = Images().read_tiles(read_constant(shader, "file", Usd.TimeCode(0)), "raw", shader.GetPrim())
        colors.append([(corner, image.pixels.tolist()) for corner, image in tiles.images])
    assert colors[0] == colors[1]
    assert [corner for corner, _ in colors[0]] == [(0, 0), (1, 1)]


def test_a_set_without_tiles(tiled, tmp_path) -> None:
    for file in (tmp_path / "tiles").iterdir():
        file.unlink()
    with pytest.raises(StageError, match=r"^/World/Target/Paint/Texture: its image @./tiles/a.<UDIM>.png@ has no tile"):
        StageReader(tiled).scene(StageReader(tiled).frames[0])


@pytest.mark.parametrize(("space", "noted"), [("raw", 0), ("sRGB", 1), ("auto", 1)])
def test_numbers_that_are_decoded_from_srgb_are_noted(make_stage, tmp_path, space, noted) -> None:
    """Of 8 bits and three channels "auto" is sRGB; a colour from the same node is no case of it."""
    (tmp_path / "a.png").write_bytes(png(PIXELS, color=6))
    inputs = "float inputs:roughness.connect = </World/Target/Paint/Texture.outputs:r>\n" + RGB
    empty = {"texture": "", "interface": "", "reader": "", "nodes": ""}
    text = STAGE.format(inputs=inputs, primvars=ST, st="Reader", **empty).replace('"raw"', f'"{space}"')
    reader = StageReader(make_stage(text))
    reader.scene(reader.frames[0])
    assert [note.code for note in reader.notes].count("texture-srgb") == noted
