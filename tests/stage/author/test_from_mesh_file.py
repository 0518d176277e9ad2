"""A mesh file's model as USD: what USD itself computes from the asset is what the file said."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, UsdSemantics, UsdShade, UsdUtils

from spin_usd.errors import GeometryError
from spin_usd.scene.asset import (
    RAW,
    SRGB,
    ImageFile,
    ImageMap,
    ImageTransform,
    MeshAsset,
    MeshPart,
    ModelMaterial,
)
from spin_usd.scene.material import PRESENCE, Material
from spin_usd.scene.texture import Primvar
from spin_usd.stage.author.from_mesh_file import write_mesh_target
from spin_usd.stage.check.check_stage import validator_findings

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0.1]]

ST = np.random.default_rng(1).random((7, 2))


def part(name: str = "Bus", **changed: object) -> MeshPart:
    values = {
        "points": np.array(SQUARE, float),
        "face_counts": np.array([4, 3], np.int32),
        "face_indices": np.array([0, 1, 2, 3, 0, 1, 4], np.int32),
        "normals": np.array([[0, 0, 2.0]] * 4 + [[0, 0, 0]] * 3),
        "face_material": np.array([0, 1], np.int32),
    }
    return MeshPart(name=name, **(values | changed))  # type: ignore[arg-type]


def png(grey: int) -> bytes:
    data = io.BytesIO()
    Image.new("RGB", (2, 2), (grey, grey, grey)).save(data, "PNG")
    return data.getvalue()


def source_of(shader: UsdShade.Shader, name: str) -> tuple[UsdShade.Shader, str]:
    ((source,), _) = shader.GetInput(name).GetConnectedSources()
    return UsdShade.Shader(source.source.GetPrim()), source.sourceName


@pytest.fixture
def textured(tmp_path: Path) -> Usd.Stage:
    base = ImageMap(
        file=ImageFile(name="a<b.png", data=png(1)),
        color_space=SRGB,
        placement=ImageTransform(scale=(2, 3), rotation_deg=30, translation=(0.5, 0.25)),
        wrap=("clamp", "mirror"),
        scale=(1, 0.5, 0.25, 1),
    )
    packed = ImageMap(file=ImageFile(name="A@B.png", data=png(2)), color_space=RAW, output="g")
    normal = ImageMap(
        file=ImageFile(name="other.png", data=png(2)), color_space=RAW, scale=(2, 2, 2, 1), bias=(-1, -1, -1, 0)
    )
    images = {
        "diffuseColor": base,
        "opacity": replace(base, output="a"),
        "roughness": packed,
        "metallic": replace(packed, output="b"),
        "normal": normal,
    }
    paint = ModelMaterial(constants=Material(path="paint", opacity_mode=PRESENCE), images=images)
    vertex = ModelMaterial(constants=Material(path="vertex", diffuse_color=Primvar(name="displayColor")))
    bus = part(primvars={"st": ST, "displayColor": np.full((7, 3), 0.5)})
    return Usd.Stage.Open(
        str(write_mesh_target(MeshAsset(name="m", parts=(bus,), materials=(paint, vertex)), tmp_path / "m", "model"))
    )


@pytest.fixture
def stage(tmp_path: Path) -> Usd.Stage:
    asset = MeshAsset(
        name="model",
        parts=(
            part(),
            part("bus", face_material=np.array([0, 0], np.int32), normals=None),
            part("Antena nº 1/2", face_material=np.array([-1, 1], np.int32)),
            part("mtl"),
        ),
        materials=(
            ModelMaterial(constants=Material(path="Óxido (1)", diffuse_color=(0.1, 0.2, 0.3))),
            ModelMaterial(constants=Material(path="gold", metallic=0.5, roughness=0.25)),
        ),
    )
    return Usd.Stage.Open(str(write_mesh_target(asset, tmp_path / "model", "model")))


def test_the_interface_is_a_component_with_a_payload(stage: Usd.Stage) -> None:
    root = stage.GetDefaultPrim()
    assert (root.GetName(), Usd.ModelAPI(root).GetKind()) == ("Model", "component")
    assert root.HasAuthoredPayloads()
    unloaded = Usd.Stage.Open(stage.GetRootLayer(), Usd.Stage.LoadNone)
    assert not unloaded.GetDefaultPrim().GetChildren()
    hint = np.array(UsdGeom.ModelAPI(unloaded.GetDefaultPrim()).GetExtentsHint())
    assert np.array_equal(hint, np.float32([[0, 0, 0], [1, 1, 0.1]]))


def test_every_part_is_a_mesh_with_its_label_under_a_name_of_its_own(stage: Usd.Stage) -> None:
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert [prim.GetName() for prim in meshes] == ["Bus", "bus_2", "Antena_n__1_2", "mtl_2"]
    labels = [UsdSemantics.LabelsAPI(prim, "part").GetLabelsAttr().Get()[0] for prim in meshes]
    assert labels == ["Bus", "bus", "Antena nº 1/2", "mtl"]
    query = UsdSemantics.LabelsQuery("class", Usd.TimeCode.Default())
    assert all(query.ComputeUniqueInheritedLabels(prim) == {"spacecraft"} for prim in meshes)


def test_polygons_points_and_extent_are_the_parts_own(stage: Usd.Stage) -> None:
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Model/Bus"))
    assert np.array_equal(mesh.GetPointsAttr().Get(), np.float32(SQUARE))
    assert list(mesh.GetFaceVertexCountsAttr().Get()) == [4, 3]
    assert list(mesh.GetFaceVertexIndicesAttr().Get()) == [0, 1, 2, 3, 0, 1, 4]
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
    assert list(UsdGeom.Boundable.ComputeExtentFromPlugins(mesh, 0)) == list(mesh.GetExtentAttr().Get())
    valid, reason = UsdGeom.Mesh.ValidateTopology(
        mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), len(SQUARE)
    )
    assert valid, reason


def test_normals_are_of_unit_length_and_the_faces_own_where_the_file_has_none(stage: Usd.Stage) -> None:
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Model/Bus"))
    assert mesh.GetNormalsInterpolation() == "faceVarying"
    assert np.array_equal(mesh.GetNormalsAttr().Get(), [[0, 0, 1]] * 4 + [[0, -1, 0]] * 3)
    faceted = UsdGeom.Mesh(stage.GetPrimAtPath("/Model/bus_2"))  # which Blender would show smooth without any
    assert faceted.GetNormalsInterpolation() == "uniform"
    assert np.array_equal(np.linalg.norm(faceted.GetNormalsAttr().Get(), axis=1), [1, 1])


def test_every_face_has_the_material_that_usd_computes(stage: Usd.Stage) -> None:
    whole = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath("/Model/bus_2")).ComputeBoundMaterial()[0]
    assert whole.GetPath() == "/Model/mtl/_xido__1_"
    mesh = UsdGeom.Imageable(stage.GetPrimAtPath("/Model/Antena_n__1_2"))
    subsets = UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets()
    assert UsdGeom.Subset.ValidateFamily(mesh, "face", "materialBind")[0]
    bound = {s.GetIndicesAttr().Get()[0]: _material_of(s) for s in subsets}
    assert bound == {0: "neutral", 1: "gold"}
    surface = UsdShade.Material(stage.GetPrimAtPath("/Model/mtl/gold")).ComputeSurfaceSource()[0]
    assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
    assert (surface.GetInput("metallic").Get(), surface.GetInput("roughness").Get()) == (0.5, 0.25)
    assert stage.GetPrimAtPath("/Model/mtl/_xido__1_").GetDisplayName() == "Óxido (1)"


def test_textures_are_the_nodes_that_usd_knows(textured: Usd.Stage) -> None:
    assert list(validator_findings(textured)) == []
    surface = UsdShade.Material(textured.GetPrimAtPath("/Model/mtl/paint")).ComputeSurfaceSource()[0]
    nodes = {name: source_of(surface, name) for name in ("diffuseColor", "opacity", "roughness", "metallic", "normal")}
    outputs = {name: (node.GetPrim().GetName(), output) for name, (node, output) in nodes.items()}
    assert outputs == {
        "diffuseColor": ("diffuseColorTexture", "rgb"),
        "opacity": ("diffuseColorTexture", "a"),
        "roughness": ("roughnessTexture", "g"),
        "metallic": ("roughnessTexture", "b"),
        "normal": ("normalTexture", "rgb"),
    }
    base = nodes["diffuseColor"][0]
    found = {i.GetBaseName(): i.Get() for i in base.GetInputs() if not i.HasConnectedSource()}
    assert found.pop("file").path == "./textures/a_b.png"
    assert found == {
        "sourceColorSpace": "sRGB", "wrapS": "clamp", "wrapT": "mirror",
        "scale": (1, 0.5, 0.25, 1), "bias": (0, 0, 0, 0),
    }  # fmt: skip
    place, _ = source_of(base, "st")
    assert place.GetIdAttr().Get() == "UsdTransform2d"
    assert [place.GetInput(name).Get() for name in ("scale", "rotation", "translation")] == [(2, 3), 30, (0.5, 0.25)]
    reader, _ = source_of(place, "in")
    assert (reader.GetIdAttr().Get(), reader.GetInput("varname").Get()) == ("UsdPrimvarReader_float2", "st")
    assert source_of(nodes["normal"][0], "st")[0].GetIdAttr().Get() == "UsdPrimvarReader_float2"
    assert not surface.GetInput("diffuseColor").GetAttr().HasAuthoredValue()
    assert surface.GetInput("opacityMode").Get() == "presence"


def test_images_are_files_beside_the_layers_once_each(textured: Usd.Stage) -> None:
    folder = Path(textured.GetRootLayer().realPath).parent / "textures"
    found = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert found == {"a_b.png": png(1), "A_B_2.png": png(2)}
    assert not UsdUtils.ComputeAllDependencies(textured.GetRootLayer().identifier)[2]


def test_primvars_have_a_value_for_each_corner(textured: Usd.Stage) -> None:
    api = UsdGeom.PrimvarsAPI(textured.GetPrimAtPath("/Model/Bus"))
    st, color = api.GetPrimvar("st"), api.GetPrimvar("displayColor")
    assert (st.GetTypeName(), st.GetInterpolation()) == (Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    assert (color.GetTypeName(), color.GetInterpolation()) == (Sdf.ValueTypeNames.Color3fArray, "faceVarying")
    assert np.array_equal(st.Get(), np.float32(ST))
    surface = UsdShade.Material(textured.GetPrimAtPath("/Model/mtl/vertex")).ComputeSurfaceSource()[0]
    reader, _ = source_of(surface, "diffuseColor")
    assert (reader.GetIdAttr().Get(), reader.GetInput("varname").Get()) == ("UsdPrimvarReader_float3", "displayColor")


def test_layers_are_separate_by_concern(stage: Usd.Stage) -> None:
    names = {Path(layer.identifier).name for layer in stage.GetUsedLayers() if not layer.anonymous}
    assert names == {"model.usda", "payload.usda", "look.usda", "geometry.usdc"}
    look = Sdf.Layer.FindOrOpen(str(Path(stage.GetRootLayer().realPath).parent / "look.usda"))
    assert not look.GetPrimAtPath("/Model/Bus").properties.get("points")


@pytest.mark.parametrize(
    ("changed", "found"),
    [
        ({"points": np.array([[np.nan, 0, 0]] * 5)}, "NaN"),
        ({"face_indices": np.array([0, 1, 2, 3, 0, 1, 5])}, "point 5"),
        ({"face_indices": np.array([0, 1, 2, 3, 0, 1, -2])}, "point -2"),
        ({"face_counts": np.array([4, 2])}, "fewer than 3"),
        ({"face_counts": np.zeros(0), "face_indices": np.zeros(0), "face_material": np.zeros(0)}, "no faces"),
    ],
)
def test_a_part_refuses_what_is_no_mesh(changed: dict[str, object], found: str) -> None:
    with pytest.raises(GeometryError, match=found):
        part(**changed)


def _material_of(subset: UsdGeom.Subset) -> str:
    return str(UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()[0].GetPrim().GetName())
