"""A mesh file's model as USD: what USD itself computes from the asset is what the file said."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSemantics, UsdShade

from spin_usd.errors import GeometryError
from spin_usd.scene.asset import MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.material import Material
from spin_usd.stage.mesh_target import write_mesh_target

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0.1]]


def part(name: str = "Bus", **changed: object) -> MeshPart:
    values = {
        "points": np.array(SQUARE, float),
        "face_counts": np.array([4, 3], np.int32),
        "face_indices": np.array([0, 1, 2, 3, 0, 1, 4], np.int32),
        "normals": np.array([[0, 0, 2.0]] * 4 + [[0, 0, 0]] * 3),
        "face_material": np.array([0, 1], np.int32),
    }
    return MeshPart(name=name, **(values | changed))  # type: ignore[arg-type]


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
    assert not UsdGeom.Mesh(stage.GetPrimAtPath("/Model/bus_2")).GetNormalsAttr().HasAuthoredValue()


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
