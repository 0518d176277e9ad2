"""UsdPreviewSurface as bound: constants, interfaces, bindings, displayColor; everything else refused by name."""

from contextlib import nullcontext

import numpy as np
import pytest
from pxr import Sdr

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.material import Material
from spin_usd.stage.read.stage_reader import StageReader

FLOAT32 = 1e-7
MATERIAL = """
    def Cube "Box" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        rel material:binding = </World/Target/Paint>
    }}
    def Material "Paint"
    {{
        {interface}
        token outputs:surface.connect = </World/Target/Paint/Surface.outputs:surface>
        def Shader "Surface"
        {{
            uniform token info:id = "{id}"
            {inputs}
            token outputs:surface
        }}
        {nodes}
    }}
"""


def material(inputs="", interface="", nodes="", kind="UsdPreviewSurface"):
    return MATERIAL.format(inputs=inputs, interface=interface, nodes=nodes, id=kind)


KEEP = "uniform bool spin:target:keepTransparent = true"


@pytest.fixture
def read_material(read_scene):
    def read(*arguments, **options):
        target = read_scene(material(*arguments, **options)).bodies[0].target
        assert len(target.materials) == 1
        return target.materials[0]

    return read


def test_constants(read_material) -> None:
    found = read_material(
        """color3f inputs:diffuseColor = (0.1, 0.2, 0.3)
        color3f inputs:emissiveColor = (0.5, 0, 0)
        color3f inputs:specularColor = (0.4, 0.4, 0.4)
        int inputs:useSpecularWorkflow = 1
        float inputs:metallic = 0.25
        float inputs:roughness = 0.75
        float inputs:clearcoat = 0.5
        float inputs:clearcoatRoughness = 0.125
        float inputs:opacity = 0.5
        float inputs:ior = 1.25"""
    )
    assert found.path == "/World/Target/Paint"
    np.testing.assert_allclose(found.diffuse_color, (0.1, 0.2, 0.3), atol=FLOAT32)
    np.testing.assert_allclose(found.specular_color, (0.4, 0.4, 0.4), atol=FLOAT32)
    assert found.emissive_color == (0.5, 0, 0)
    assert found.use_specular_workflow is True
    assert (found.metallic, found.roughness, found.clearcoat) == (0.25, 0.75, 0.5)
    assert (found.clearcoat_roughness, found.opacity, found.ior) == (0.125, 0.5, 1.25)


def test_fallbacks_are_those_of_usds_own_shader_definition(read_material) -> None:
    node = Sdr.Registry().GetShaderNodeByIdentifier("UsdPreviewSurface")
    default = {name: node.GetShaderInput(name).GetDefaultValue() for name in node.GetShaderInputNames()}
    found = read_material()
    for name, value in {
        "diffuseColor": found.diffuse_color,
        "emissiveColor": found.emissive_color,
        "specularColor": found.specular_color,
        "useSpecularWorkflow": int(found.use_specular_workflow),
        "metallic": found.metallic,
        "roughness": found.roughness,
        "clearcoat": found.clearcoat,
        "clearcoatRoughness": found.clearcoat_roughness,
        "opacity": found.opacity,
        "ior": found.ior,
    }.items():
        np.testing.assert_allclose(value, default[name], atol=FLOAT32, err_msg=name)


def test_values_from_the_materials_interface(read_material) -> None:
    found = read_material(
        "color3f inputs:diffuseColor.connect = </World/Target/Paint.inputs:tint>",
        interface="color3f inputs:tint = (0.5, 0.25, 1)",
    )
    assert found.diffuse_color == (0.5, 0.25, 1)


@pytest.mark.parametrize(("opacity", "seen"), [(0.4, 0.0), (0.6, 1.0)])
def test_a_threshold_makes_opacity_all_or_nothing(read_scene, opacity, seen) -> None:
    inputs = f"float inputs:opacity = {opacity}\nfloat inputs:opacityThreshold = 0.5"
    (found,) = read_scene(f"{KEEP}\n{material(inputs)}").bodies[0].target.materials
    assert found.opacity == seen


@pytest.mark.parametrize(
    ("inputs", "nodes", "error", "saying"),
    [
        ("float inputs:roughness = 1.5", "", StageError, "Surface: its roughness is 1.5"),
        ("float inputs:metallic = -1", "", StageError, "Surface: its metallic is -1"),
        (
            "color3f inputs:diffuseColor = (2, 1, 1)",
            "",
            StageError,
            "Surface: its diffuseColor is 2; keep it between 0",
        ),
        ("color3f inputs:emissiveColor = (1e30, 1, 1)", "", StageError, r"Surface: its emissiveColor is 1e\+30; keep"),
        ("float inputs:ior = 0", "", StageError, "Surface: its ior is 0; keep it between 1 and 1000"),
        ("float inputs:opacityThreshold = 2", "", StageError, "Surface: its opacityThreshold is 2; keep"),
        ("float inputs:occlusion = -1", "", StageError, "Surface: its occlusion is -1; keep"),
        (
            "float inputs:ior.connect = </World/Target/Paint/Reader.outputs:result>",
            """def Shader "Reader" {
                uniform token info:id = "UsdPrimvarReader_float"
                string inputs:varname = "glass"
                float inputs:fallback = 0.5
                float outputs:result
            }""",
            StageError,
            "Surface: its ior is 0.5, by the fallback of primvars:glass; keep it",
        ),
        ("color3f inputs:diffuseColor = (nan, 0, 0)", "", StageError, r"Surface.inputs:diffuseColor: is \(nan, 0, 0\)"),
        (
            'color3f inputs:diffuseColor = (1, 0, 0) (\ncolorSpace = "sRGB"\n)',
            "",
            UnsupportedError,
            "Surface.inputs:diffuseColor: is given in colour space 'sRGB'",
        ),
    ],
)
def test_what_is_no_constant_is_refused_by_name(read_material, inputs, nodes, error, saying) -> None:
    with pytest.raises(error, match=f"^/World/Target/Paint/{saying}"):
        read_material(inputs, nodes=nodes)


IN_SPACE = """def Xform "Group" (
    prepend apiSchemas = ["ColorSpaceAPI"]
)
{{
    uniform token colorSpace:name = "{space}"
    def Cube "Box" {{
        {attribute}
    }}
}}"""


@pytest.mark.parametrize(
    ("space", "attribute", "refused"),
    [
        ("lin_ap1_scene", "color3f[] primvars:displayColor = [(1, 0, 0)]", True),
        ("lin_rec709_scene", "color3f[] primvars:displayColor = [(1, 0, 0)]", False),
        ("lin_ap1_scene", "float[] primvars:displayOpacity = [0.5]", False),
    ],
)
def test_color_space_api_counts_for_colours_below_it(read_scene, space, attribute, refused) -> None:
    geometry = IN_SPACE.format(space=space, attribute=attribute)
    with pytest.raises(UnsupportedError, match=f"'{space}'") if refused else nullcontext():
        read_scene(geometry)


def test_a_binding_that_a_reference_leaves_behind_is_noted(make_stage, tmp_path) -> None:
    """USD drops a target outside of what is referenced with a mere warning; it must not turn into grey unsaid."""
    (tmp_path / "model.usda").write_text(
        """#usda 1.0
def Cube "Box" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{
    rel material:binding = </Materials/Paint>
}
def Scope "Materials"
{
    def Material "Paint"
    {
    }
}
"""
    )
    reader = StageReader(make_stage('def "Box" (\nreferences = @./model.usda@</Box>\n)\n{\n}'))
    reader.scene(reader.frames[0])
    (note,) = reader.notes
    assert note.message.startswith("is bound to /Materials/Paint, which is not a material")


def test_bindings_are_inherited_and_full_wins_over_all_purpose(read_scene) -> None:
    geometry = """
    def Xform "Group" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        rel material:binding = </World/Target/All>
        rel material:binding:full = </World/Target/Full>
        rel material:binding:preview = </World/Target/Preview>
        def Cube "Box" {}
    }"""
    for name, red in {"All": 0.1, "Full": 0.5, "Preview": 0.9}.items():
        geometry += material(f"color3f inputs:diffuseColor = ({red}, 0, 0)").split("}", 1)[1].replace("Paint", name)
    assert [m.path for m in read_scene(geometry).bodies[0].target.materials] == ["/World/Target/Full"]


def test_display_color_is_the_diffuse_color_where_nothing_is_bound(read_scene) -> None:
    geometry = """
    def Xform "Group"
    {
        color3f[] primvars:displayColor = [(0.25, 0.5, 1)]
        def Cube "Inherits" {}
        def Cube "Own"
        {
            color3f[] primvars:displayColor = [(1, 1, 0), (1, 1, 0)] (
                interpolation = "vertex"
            )
            float[] primvars:displayOpacity = [0.5]
        }
    }
    def Cube "Plain" {}"""
    found = read_scene(geometry).bodies[0].target.materials
    assert [(m.diffuse_color, m.opacity) for m in found] == [
        ((0.25, 0.5, 1), 1),
        ((1, 1, 0), 0.5),
        (Material(path="").diffuse_color, 1),
    ]


@pytest.mark.parametrize(
    ("authored", "saying"),
    [
        (
            "color3f[] primvars:displayColor = [(0, -2, 0)]",
            "displayColor: its displayColor is -2; keep it between 0 and 1",
        ),
        ("float[] primvars:displayOpacity = [-1]", "displayOpacity: its displayOpacity is -1; keep it"),
    ],
)
def test_a_display_color_that_is_none_is_refused(read_scene, authored, saying) -> None:
    with pytest.raises(StageError, match=rf"^/World/Target/Box.primvars:{saying}"):
        read_scene(f'def Cube "Box"\n{{\n{authored}\n}}')


def test_primvars_are_held_to_what_the_input_can_be(read_scene) -> None:
    reader = """def Shader "Reader" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "tint"
        float3 outputs:result
    }"""
    text = material("color3f inputs:diffuseColor.connect = </World/Target/Paint/Reader.outputs:result>", nodes=reader)
    authored = "rel material:binding = </World/Target/Paint>\nfloat3[] primvars:tint = [({}, 0, 0)]"
    bound = "rel material:binding = </World/Target/Paint>"
    assert read_scene(text.replace(bound, authored.format(1))).bodies[0].target.materials
    saying = r"^/World/Target/Paint: its diffuseColor is 3, by /World/Target/Box.primvars:tint; keep it between 0 and 1"
    with pytest.raises(StageError, match=saying):
        read_scene(text.replace(bound, authored.format(3)), name="b.usda")


def test_a_display_color_that_varies_over_a_shape_is_refused(read_scene) -> None:
    geometry = 'def Cube "Box"\n{\ncolor3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)]\n}'
    with pytest.raises(UnsupportedError, match=r"^/World/Target/Box.primvars:displayColor: varies over the Cube"):
        read_scene(geometry)
