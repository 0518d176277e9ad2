"""What others wrote and what is rendered otherwise than they say: rendered, and told by check, plan and author."""

import numpy as np
import pytest
from pxr import Gf

from spin_usd.errors import StageError
from spin_usd.scene.material import Material
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.stage_reader import StageReader

FLOAT32 = 1e-6
PAINTED = """
def Cube "Box" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{{
    color3f[] primvars:displayColor = [(0.25, 0.5, 0.75)]
    rel material:binding = </World/Target/Looks/Paint>
}}
def Scope "Looks" {scope}
{{
{paint}
}}
"""
PAINT = """def Material "Paint"
{{
    token outputs:{output}.connect = </World/Target/Looks/Paint/Surface.outputs:surface>
    def Shader "Surface"
    {{
        {shader}
        token outputs:surface
    }}
}}"""
FOREIGN = {
    "another node": ("", PAINT.format(output="surface", shader='uniform token info:id = "ND_open_pbr_surface"')),
    "another context": ("", PAINT.format(output="mtlx:surface", shader='uniform token info:id = "ND_standard"')),
    "code": (
        "",
        PAINT.format(
            output="surface",
            shader='uniform token info:implementationSource = "sourceAsset"\n'
            "uniform asset info:glslfx:sourceAsset = @./paint.glslfx@",
        ),
    ),
    "no surface": ("", 'def Material "Paint"\n{\n}'),
    "a document": ("(\n prepend references = @./paint.mtlx@</Materials>\n)", ""),
}


@pytest.fixture
def read(make_stage):
    """The first picture of a stage of this geometry, and the codes of what is noted."""

    def reading(geometry, name="stage.usda"):
        reader = StageReader(make_stage(geometry, name=name))
        target = reader.scene(reader.frames[0]).bodies[0].target
        return target, [note.code for note in reader.notes]

    return reading


@pytest.mark.parametrize("name", FOREIGN)
def test_what_is_not_a_preview_surface_has_its_display_color(read, make_stage, tmp_path, name) -> None:
    (tmp_path / "paint.mtlx").write_text('<?xml version="1.0"?>\n<materialx version="1.38">\n</materialx>\n')
    (tmp_path / "paint.glslfx").write_text("-- glslfx version 0.1\n")
    scope, paint = FOREIGN[name]
    target, codes = read(PAINTED.format(scope=scope, paint=paint))
    assert [material.diffuse_color for material in target.materials] == [(0.25, 0.5, 0.75)]
    assert codes == ["material-foreign"]
    told = {finding.code: finding for finding in check_stage(tmp_path / "stage.usda")}
    assert told["material-foreign"].where == "/World/Target/Looks/Paint"
    assert "rendered in their displayColor" in told["material-foreign"].message
    assert "error" not in {finding.severity for finding in told.values()}


def test_a_document_does_not_excuse_what_else_does_not_compose(make_stage, tmp_path) -> None:
    (tmp_path / "paint.mtlx").write_text("<materialx/>")
    both = "(\n prepend references = [@./paint.mtlx@</Materials>, @./none.usda@]\n)"
    with pytest.raises(StageError, match=r"does not compose: .*none\.usda"):
        open_stage(make_stage(PAINTED.format(scope=both, paint="")))


@pytest.mark.parametrize("interpolation", ["constant", "uniform"])
def test_a_display_color_above_one_is_one(read, interpolation) -> None:
    colors = "(1.2, 0.5, 0.5)" if interpolation == "constant" else "(1.2, 0.5, 0.5), (0.1, 0.2, 3)"
    color = f'color3f[] primvars:displayColor = [{colors}] (\n interpolation = "{interpolation}"\n)'
    mesh = f"""def Mesh "M"
{{
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
    {color}
}}"""
    target, codes = read(mesh)
    assert codes == ["color-clamped"]
    if interpolation == "constant":
        assert target.materials[0].diffuse_color == pytest.approx((1, 0.5, 0.5), abs=FLOAT32)
    else:
        values = target.mesh.primvars["displayColor"][:, 0]
        np.testing.assert_allclose(values, [[1, 0.5, 0.5], [0.1, 0.2, 1]], atol=FLOAT32)


def test_a_mesh_without_faces_is_passed_over(read) -> None:
    target, codes = read('def Cube "Box"\n{\n}\ndef Mesh "Empty"\n{\n}')
    assert (len(target.parts), codes) == (1, ["mesh-empty"])
    with pytest.raises(StageError, match="the target has no geometry"):
        read('def Mesh "Empty"\n{\n}', name="b.usda")


@pytest.mark.parametrize("kind", ["quath", "quatf", "quatd"])
def test_a_rounded_orientation_is_normalised(read, make_stage, kind) -> None:
    """By hand: 0.7071 twice is a quarter turn about x, which takes y to z."""
    text = f"""def Xform "Turned"
{{
    {kind} xformOp:orient = (0.7071, 0.7071, 0, 0)
    double3 xformOp:translate = (1, 2, 3)
    float3 xformOp:scale = (1, 2, 1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient", "xformOp:scale"]
    def Cube "Box"
    {{
    }}
}}"""
    target, codes = read(text)
    assert codes == ["orient-rounded"]
    corners = target.mesh.points[np.unique(target.mesh.faces)]
    np.testing.assert_allclose(corners.min(0), [0, 1, 1], atol=2 * FLOAT32)
    np.testing.assert_allclose(corners.max(0), [2, 3, 5], atol=2 * FLOAT32)


def test_what_is_normalised_is_what_usd_places_for_a_whole_quaternion(read, make_stage) -> None:
    """Ops in one list, an inverse one among them, against UsdGeom's own product of them."""
    ops = ["xformOp:translate", "!invert!xformOp:orient", "xformOp:rotateXYZ", "xformOp:scale"]
    text = f"""def Cube "Box"
{{
    quatd xformOp:orient = QUATERNION
    float3 xformOp:rotateXYZ = (10, 20, 30)
    double3 xformOp:translate = (1, 2, 3)
    float3 xformOp:scale = (1, 2, 1)
    uniform token[] xformOpOrder = [{", ".join(f'"{op}"' for op in ops)}]
}}"""
    rounded = read(text.replace("QUATERNION", "(0.801, 0.6, 0, 0)"))[0]
    unit = Gf.Quatd(0.801, 0.6, 0, 0).GetNormalized()
    whole = f"({unit.GetReal()!r}, {unit.GetImaginary()[0]!r}, 0, 0)"
    path = make_stage(text.replace("QUATERNION", whole), name="whole.usda")
    reader = StageReader(path)
    np.testing.assert_allclose(
        rounded.mesh.points, reader.scene(reader.frames[0]).bodies[0].target.mesh.points, atol=1e-12
    )


def test_what_was_not_merely_rounded_is_refused(read) -> None:
    order = 'uniform token[] xformOpOrder = ["xformOp:orient"]'
    text = f'def Cube "Box"\n{{\n quatd xformOp:orient = (1, 0.3, 0, 0)\n {order}\n}}'
    with pytest.raises(StageError, match="which is not a rotation; normalise it"):
        read(text)


def test_nothing_is_noted_of_what_is_rendered_as_it_says(read) -> None:
    target, codes = read(
        PAINTED.format(
            scope="", paint=PAINT.format(output="surface", shader='uniform token info:id = "UsdPreviewSurface"')
        )
    )
    assert codes == []
    assert target.materials[0].diffuse_color == Material(path="").diffuse_color
