"""What other readers of USD take in their stride: read as USD says it means, and noted."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from spin_usd.errors import UnsupportedError
from spin_usd.stage.read.stage_reader import StageReader

CUBE = """
int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
int[] faceVertexIndices = [0, 1, 3, 2, 2, 3, 5, 4, 4, 5, 7, 6, 6, 7, 1, 0, 1, 7, 5, 3, 6, 0, 2, 4]
point3f[] points = [(0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1), (0, 1, 0), (1, 1, 0), (0, 0, 0), (1, 0, 0)]
"""
MATERIAL = """
def Material "Paint" {
    float inputs:own
    token outputs:surface.connect = </World/Target/Paint/Surface.outputs:surface>
    def Shader "Surface" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness = 0.25
        INPUT
        token outputs:surface
    }
    def Shader "Image" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @gone.png@
        float4 inputs:fallback = (0.1, 0.2, 0.3, 1)
        float3 outputs:rgb
    }
}
"""


def mesh(text="", *, name="Box", bound="", scheme="none", api="") -> str:
    binding = f"rel material:binding = <{bound}>" if bound else ""
    applied = f'(prepend apiSchemas = ["MaterialBindingAPI"{api}])' if bound else ""
    return f'def Mesh "{name}" {applied} {{\nuniform token subdivisionScheme = "{scheme}"{CUBE}{text}\n{binding}\n}}\n'


def material(text: str) -> str:
    return mesh(bound="/World/Target/Paint") + MATERIAL.replace("INPUT", text)


def connected(name: str, to: str) -> str:
    return material(f"float inputs:{name}.connect = </World/Target/Paint{to}>")


@pytest.fixture
def read(make_stage):
    """The target of a stage with that geometry, the codes of what is noted, and the stage."""

    def of(geometry, **more):
        path = make_stage(geometry, **more)
        reader = StageReader(path)
        scene = reader.scene(reader.frames[0])
        return scene, {(note.code, note.where) for note in reader.notes}, Usd.Stage.Open(str(path))

    return of


PROTOTYPES = """
def PointInstancer "Many" {
    point3f[] positions = [(2, 0, 0), (0, 3, 0)]
    int[] protoIndices = [0, 0]
    rel prototypes = </World/Target/Store/Post>
}
over "Store" {
    POST
}
"""


@pytest.mark.parametrize(
    ("geometry", "noted"),
    [
        (mesh('token visibility = "visible"'), {("visibility-unknown", "Box.visibility")}),
        (mesh(bound="/World/Target/Nowhere"), {("material-missing", "Box")}),
        (connected("clearcoat", "/Gone.outputs:r"), {("connection-lost", "Paint/Surface.inputs:clearcoat")}),
        (connected("clearcoat", ".inputs:own"), {("connection-lost", "Paint/Surface.inputs:clearcoat")}),
        (mesh() + 'def BasisCurves "Wire" {}', {("geometry-thin", "Wire")}),
        (mesh() + 'def Points "Dots" {}', {("geometry-thin", "Dots")}),
    ],
)
def test_what_usd_gives_a_meaning_is_read_with_a_note(read, geometry, noted) -> None:
    scene, notes, stage = read(geometry)
    assert notes == {(code, f"/World/Target/{where}") for code, where in noted}
    box = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeRelativeBound(
        stage.GetPrimAtPath("/World/Target/Box"), stage.GetPrimAtPath("/World/Target")
    )
    found = scene.bodies[0].target.mesh.points
    np.testing.assert_allclose([found.min(0), found.max(0)], [box.GetRange().GetMin(), box.GetRange().GetMax()])


def test_an_input_keeps_its_own_value_where_its_connection_leads_nowhere(read) -> None:
    scene, notes, _ = read(connected("roughness", "/Gone.outputs:r"))
    assert scene.bodies[0].target.materials[0].roughness == pytest.approx(0.25)
    assert notes == {("connection-lost", "/World/Target/Paint/Surface.inputs:roughness")}


def test_a_missing_image_without_a_folder_before_its_name_has_its_fallback(read, monkeypatch, tmp_path) -> None:
    """USD looks for such a name in the working folder too, and says that it should be there."""
    monkeypatch.chdir("/")
    scene, notes, _ = read(material("color3f inputs:diffuseColor.connect = </World/Target/Paint/Image.outputs:rgb>"))
    assert scene.bodies[0].target.materials[0].diffuse_color == pytest.approx((0.1, 0.2, 0.3))
    assert notes == {("image-missing", "/World/Target/Paint/Image")}


def test_an_instancer_shows_what_an_over_keeps_for_it_alone(read) -> None:
    scene, notes, stage = read(PROTOTYPES.replace("POST", mesh(name="Post")))
    instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath("/World/Target/Many"))
    placed = instancer.ComputeInstanceTransformsAtTime(Usd.TimeCode.Default(), Usd.TimeCode.Default())
    corners = np.array([(0, 0, 0), (1, 1, 1)]) + np.array([m.ExtractTranslation() for m in placed])[:, None]
    found = scene.bodies[0].target.mesh.points
    np.testing.assert_allclose([found.min(0), found.max(0)], [corners.min((0, 1)), corners.max((0, 1))])
    assert not notes
    assert len(scene.bodies[0].target.mesh.faces) == 2 * 12  # and is not shown by itself


def test_a_crease_of_many_steps_is_as_one_without_end(read) -> None:
    crease = "int[] creaseIndices = [0, 1, 3, 2]\nint[] creaseLengths = [4]\nfloat[] creaseSharpnesses = [{}]"
    found = {s: read(mesh(crease.format(s), scheme="catmullClark"), name=f"{s}.usda") for s in (4.0, 5.0, 10.0)}
    assert found[5.0][1] == {("crease-sharp", "/World/Target/Box.creaseSharpnesses")}
    assert not found[4.0][1] | found[10.0][1]
    four, five, ever = (np.ptp(scene.bodies[0].target.mesh.points, 0) for scene, _, _ in found.values())
    np.testing.assert_array_equal(five, ever)
    assert 0 < np.abs(four - ever).max() < 0.02  # twice what five may be off: a hundredth of an edge


def test_curves_alone_are_no_target(read) -> None:
    with pytest.raises(Exception, match="no geometry that is rendered"):
        read('def BasisCurves "Wire" {}')


def test_a_wire_beside_the_target_hides_nothing_and_is_noted(read) -> None:
    scene, notes, _ = read(mesh(), world='def BasisCurves "Wire" {}')
    assert not scene.several
    assert notes == {("geometry-thin", "/World/Wire")}


def test_a_crease_of_half_a_step_is_refused(read) -> None:
    with pytest.raises(UnsupportedError, match=r"creaseSharpnesses such as \[0.5\]"):
        read(
            mesh(
                "int[] creaseIndices = [0, 1]\nint[] creaseLengths = [2]\nfloat[] creaseSharpnesses = [0.5]",
                scheme="catmullClark",
            )
        )
