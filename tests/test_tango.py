"""Our own Tango: the committed layers are what the script writes, hold the official points, and are sound USD."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, UsdSemantics, UsdShade, UsdUtils, UsdValidation

from spin_usd.stage.author.from_usd import copy_usd_target
from tests.conftest import REPOSITORY

FOLDER = REPOSITORY / "stages" / "targets" / "tango"
LOOKS = ("matt", "reflective", "mockup")
GEOMETRY = {f"geometry/{name}.usda" for name in ("bus", "structure", "panel", "equipment")}
LAYERS = {"tango.usda", "payload.usda", *GEOMETRY, "bindings.usda", *(f"{look}.usda" for look in LOOKS)}
MAX_LAYER_BYTES = 1 << 20  # each is text for people and version control, which no larger file is
TEXTURES = {path.name for path in (FOLDER / "textures").iterdir()}
MAX_TEXTURE_BYTES = 20_000  # of all of them together: they are kept in the repository
MAX_LEVELS = 1  # of 255: what arithmetic on another machine may change in a texture

# tango3Dpoints of the SPEED+ baseline, in the published order (metres, body axes), and the part that holds each.
TOP, BOTTOM = "SolarPanel", "Deck"
OFFICIAL = [
    (TOP, (-0.3700, -0.3850, 0.3215)),
    (TOP, (-0.3700, 0.3850, 0.3215)),
    (TOP, (0.3700, 0.3850, 0.3215)),
    (TOP, (0.3700, -0.3850, 0.3215)),
    (BOTTOM, (-0.3700, -0.2640, 0.0)),
    (BOTTOM, (-0.3700, 0.3040, 0.0)),
    (BOTTOM, (0.3700, 0.3040, 0.0)),
    (BOTTOM, (0.3700, -0.2640, 0.0)),
    ("AntennaMinusX", (-0.5427, 0.4877, 0.2535)),
    ("AntennaPlusX", (0.5427, 0.4877, 0.2591)),
    ("AntennaMinusY", (0.3050, -0.5790, 0.2515)),
]
ANTENNAS = [(part, point) for part, point in OFFICIAL if part.startswith("Antenna")]
CLASSES = {"main_body", "solar_panel", "omni_antenna", "payload", "adapter_ring"}

# The published points, widened by the antennas' radii (x, y) and by the separation hooks below the deck.
ENVELOPE = np.array([(-0.565, -0.585, -0.0205), (0.565, 0.520, 0.3215)])
MOCKUP_LOW = {"Harness": -0.085, "SeparationRing": -0.03}  # how far the mock-up's rod and a block reach below its deck
ROUNDING = 1e-5  # the layers' decimals: ten micrometres
NORMAL_ROUNDING = 1e-3  # normals are written with three decimals
MIN_FACING = 0.05  # cosine between a corner's normal and its face: bevels turn from one flat face to the next one
ST_AREA = (0.9, 1.2)  # st over surface: slanted faces are projected, and a rod's thinner end shares its base's arc


@pytest.fixture(scope="module", params=LOOKS)
def stage(request: pytest.FixtureRequest) -> Usd.Stage:
    """Everything below holds in every look."""
    return opened(request.param)


def opened(look: str) -> Usd.Stage:
    stage = Usd.Stage.Open(str(FOLDER / "tango.usda"))
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        stage.GetDefaultPrim().GetVariantSet("look").SetVariantSelection(look)
    return stage


def pixels(file: Path) -> np.ndarray:
    return np.array(Image.open(file), dtype=np.int64)


def meshes(stage: Usd.Stage) -> list[UsdGeom.Mesh]:
    return [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]


def points_of(mesh: UsdGeom.Mesh) -> np.ndarray:
    return np.array(mesh.GetPointsAttr().Get(), dtype=np.float32)


def corner_triangles(mesh: UsdGeom.Mesh) -> np.ndarray:
    """Face corners (F, 3), as positions in faceVertexIndices."""
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get())
    starts = np.cumsum(counts) - counts
    first = np.stack([starts, starts + 1, starts + 2], axis=1)
    second = np.stack([starts, starts + 2, starts + 3], axis=1)[counts == 4]
    return np.concatenate([first, second])


def triangles_of(mesh: UsdGeom.Mesh) -> trimesh.Trimesh:
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get())
    return trimesh.Trimesh(points_of(mesh).astype(float), indices[corner_triangles(mesh)], process=False)


@pytest.mark.campaign
def test_the_committed_layers_are_what_the_script_writes(tmp_path: Path) -> None:
    subprocess.run([sys.executable, REPOSITORY / "tools" / "build_tango", tmp_path], check=True)
    written, committed = (
        {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*.usda")}
        for folder in (tmp_path, FOLDER)
    )
    assert written == committed
    assert max(map(len, written.values())) < MAX_LAYER_BYTES
    assert set(written) == LAYERS
    assert {path.name for path in (tmp_path / "textures").iterdir()} == TEXTURES
    for name in TEXTURES:
        made, kept = (pixels(folder / "textures" / name) for folder in (tmp_path, FOLDER))
        assert made.shape == kept.shape, name
        assert np.abs(made - kept).max() <= MAX_LEVELS, name


def test_usd_finds_nothing_to_complain_about(stage: Usd.Stage) -> None:
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    assert [error.GetMessage() for error in context.Validate(stage)] == []


@pytest.mark.parametrize("name", sorted(LAYERS))
def test_every_layer_says_its_own_axes_and_units(name: str) -> None:
    stage = Usd.Stage.Open(str(FOLDER / name))
    assert stage.GetDefaultPrim().GetName() == "Tango"
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.HasAuthoredMetadata("upAxis")
    assert stage.HasAuthoredMetadata("metersPerUnit")


def test_the_interface_stands_without_its_payload() -> None:
    stage = Usd.Stage.Open(str(FOLDER / "tango.usda"), Usd.Stage.LoadNone)
    prim = stage.GetDefaultPrim()
    assert not prim.IsLoaded()
    assert prim.GetKind() == "component"
    assert prim.GetAttribute("authorship:model:usageTerms").Get() == "GPL-3.0-or-later"
    hint = np.array(UsdGeom.ModelAPI(prim).GetExtentsHint())
    assert set(prim.GetVariantSet("look").GetVariantNames()) == set(LOOKS)
    prim.Load()
    box = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(prim).ComputeAlignedBox()
    np.testing.assert_allclose(hint, [box.GetMin(), box.GetMax()], atol=ROUNDING / 10)


@pytest.mark.parametrize(("part", "point"), OFFICIAL)
def test_an_official_point_is_a_point_of_its_part(stage: Usd.Stage, part: str, point: tuple[float, ...]) -> None:
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"/Tango/{part}"))
    assert (points_of(mesh) == np.array(point, dtype=np.float32)).all(axis=1).any()


def test_the_corners_are_the_corners_of_the_panel_and_of_the_deck(stage: Usd.Stage) -> None:
    for part, z in ((TOP, 1), (BOTTOM, 0)):
        corners = np.array([point for name, point in OFFICIAL if name == part])
        extent = np.array(UsdGeom.Mesh(stage.GetPrimAtPath(f"/Tango/{part}")).GetExtentAttr().Get())
        np.testing.assert_array_equal(extent[:, :2], np.float32([corners.min(axis=0), corners.max(axis=0)])[:, :2])
        if part == TOP:
            assert extent[z, 2] == np.float32(corners[0, 2])


@pytest.mark.parametrize(("part", "tip"), ANTENNAS)
def test_a_tip_is_the_end_of_its_rod(stage: Usd.Stage, part: str, tip: tuple[float, ...]) -> None:
    points = points_of(UsdGeom.Mesh(stage.GetPrimAtPath(f"/Tango/{part}"))).astype(float)
    axis = np.linalg.svd(points - points.mean(axis=0))[2][0]
    along = (points - tip) @ (axis * np.sign(axis @ (tip - points.mean(axis=0))))
    assert along.max() < ROUNDING


def test_keypoints_are_the_official_points_in_their_order(stage: Usd.Stage) -> None:
    keypoints = UsdGeom.Points(stage.GetPrimAtPath("/Tango/Keypoints"))
    np.testing.assert_array_equal(keypoints.GetPointsAttr().Get(), np.float32([point for _, point in OFFICIAL]))
    assert list(keypoints.GetIdsAttr().Get()) == list(range(1, 12))
    names = list(UsdGeom.PrimvarsAPI(keypoints).GetPrimvar("keypointName").Get())
    assert [name.rsplit("_", 1)[1] for name in names] == [str(i) for i in range(1, 12)]
    assert keypoints.GetPurposeAttr().Get() == "guide"


def test_every_part_is_closed_and_inside_out_nowhere(stage: Usd.Stage) -> None:
    for mesh in meshes(stage):
        surface = triangles_of(mesh)
        assert surface.is_watertight, mesh.GetPath()
        assert surface.is_winding_consistent, mesh.GetPath()
        piece = trimesh.graph.connected_component_labels(surface.face_adjacency, node_count=len(surface.faces))
        first, second, third = np.moveaxis(surface.triangles, 1, 0)
        volumes = np.bincount(piece, np.einsum("fi,fi->f", first, np.cross(second, third)) / 6)
        assert volumes.min() > 0, mesh.GetPath()
        assert surface.area_faces.min() > 0, mesh.GetPath()


def test_normals_are_unit_and_look_outwards(stage: Usd.Stage) -> None:
    for mesh in meshes(stage):
        primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
        assert primvar.GetInterpolation() == "faceVarying"
        normals = np.array(primvar.ComputeFlattened(), dtype=float)
        assert len(normals) == len(mesh.GetFaceVertexIndicesAttr().Get())
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=NORMAL_ROUNDING)
        facing = np.einsum("fci,fi->fc", normals[corner_triangles(mesh)], triangles_of(mesh).face_normals)
        assert facing.min() > MIN_FACING, mesh.GetPath()


def test_texture_coordinates_are_in_metres(stage: Usd.Stage) -> None:
    """A part's picture in st is as large as the part, whatever its shape."""
    for mesh in meshes(stage):
        primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        assert primvar.GetInterpolation() == "faceVarying"
        st = np.array(primvar.ComputeFlattened(), dtype=float)
        a, b, c = np.moveaxis(st[corner_triangles(mesh)], 1, 0)
        u, v = b - a, c - a
        pictured = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum() / 2
        assert ST_AREA[0] < pictured / triangles_of(mesh).area < ST_AREA[1], mesh.GetPath()


def test_every_part_is_labelled_and_the_labels_are_unique(stage: Usd.Stage) -> None:
    labels = [
        [UsdSemantics.LabelsAPI(mesh.GetPrim(), taxonomy).GetLabelsAttr().Get()[0] for taxonomy in ("class", "part")]
        for mesh in meshes(stage)
    ]
    assert {kind for kind, _ in labels} == CLASSES
    assert len({part for _, part in labels}) == len(labels)


def test_every_face_wears_one_material(stage: Usd.Stage) -> None:
    for mesh in meshes(stage):
        subsets = UsdGeom.Subset.GetAllGeomSubsets(mesh)
        assert UsdGeom.Subset.ValidateFamily(mesh, "face", "materialBind")[0] or not subsets
        for prim in [subset.GetPrim() for subset in subsets] or [mesh.GetPrim()]:
            material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
            assert material.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"


def test_a_look_changes_materials_only() -> None:
    """What labels are made of is the same in matt and reflective, down to the bytes."""
    texts = []
    for look in LOOKS[:2]:
        flat = opened(look).Flatten(addSourceFileComment=False)
        edit = Sdf.BatchNamespaceEdit()
        edit.Add("/Tango/mtl", Sdf.Path.emptyPath)
        assert flat.Apply(edit)
        texts.append(flat.ExportToString())
    assert texts[0] == texts[1]
    assert "mtl" in texts[0]


def test_the_mockup_has_the_parts_of_the_other_looks() -> None:
    """Some of them in another shape, all under the same labels."""
    matt, mockup = opened("matt"), opened("mockup")
    changed = set()
    for one, other in zip(meshes(matt), meshes(mockup), strict=True):
        assert one.GetPath() == other.GetPath()
        names = [name for name in one.GetPrim().GetPropertyNames() if name.startswith("semantics:")]
        assert names
        for name in (*names, "points", "faceVertexIndices"):
            if one.GetPrim().GetAttribute(name).Get() != other.GetPrim().GetAttribute(name).Get():
                assert name not in names
                changed.add(one.GetPrim().GetName())
    assert changed == {mesh.GetPrim().GetName() for mesh in meshes(matt)} - {"Deck"}


def test_every_material_is_in_every_look() -> None:
    stages = [opened(look) for look in LOOKS]
    matt, reflective, mockup = (
        [prim.GetName() for prim in stage.GetPrimAtPath("/Tango/mtl").GetChildren()] for stage in stages
    )
    assert matt == reflective != []
    assert set(matt) <= set(mockup)


def test_matt_is_lambert() -> None:
    """UsdPreviewSurface reflects nothing but diffusely when it is no metal, uncoated, and of the ior of vacuum."""
    stage = opened("matt")
    shaders = [UsdShade.Shader(prim) for prim in stage.Traverse() if prim.GetName() == "Surface"]
    assert shaders
    for shader in shaders:
        inputs = {i.GetBaseName(): i for i in shader.GetInputs()}
        assert {name for name, i in inputs.items() if i.HasConnectedSource()} <= {"diffuseColor"}
        assert [inputs[name].Get() for name in ("metallic", "clearcoat", "ior")] == [0, 0, 1]


def test_textures_are_small_and_all_used() -> None:
    files = [FOLDER / "textures" / name for name in TEXTURES]
    assert sum(file.stat().st_size for file in files) < MAX_TEXTURE_BYTES
    text = "".join((FOLDER / f"{look}.usda").read_text() for look in LOOKS)
    assert all(f"@./textures/{name}@" in text for name in TEXTURES)


def test_a_copy_holds_all_that_the_looks_refer_to(tmp_path) -> None:
    """Layers and textures of the library too, so that an authored stage can be moved."""
    copied = tmp_path / "model" / "tango.usda"
    copy_usd_target(FOLDER / "tango.usda", copied.parent, "tango", None)
    layers, files, missing = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(copied)))
    assert missing == []
    assert "gold_foil.usda" in {Path(layer.realPath).name for layer in layers}
    assert "foil_normal.png" in {Path(file).name for file in files}
    assert all(Path(file).is_relative_to(tmp_path) for file in [*files, *(layer.realPath for layer in layers)])


def test_the_reflective_look_says_only_what_differs_from_the_library() -> None:
    """No opinion repeats what the material of the library says of the same node."""
    layer = Sdf.Layer.FindOrOpen(str(FOLDER / "reflective.usda"))
    for material in layer.GetPrimAtPath("/Tango/mtl").nameChildren:
        (reference,) = material.referenceList.GetAddedOrExplicitItems()
        library = Usd.Stage.Open(layer.ComputeAbsolutePath(reference.assetPath))
        for node in material.nameChildren:
            shared = library.GetDefaultPrim().GetChild(node.name)
            for attribute in node.properties if shared else ():
                there = shared.GetAttribute(attribute.name)
                assert attribute.connectionPathList.explicitItems or there.Get() != attribute.default, attribute.path


def test_the_spacecraft_fills_its_envelope_and_no_more(stage: Usd.Stage) -> None:
    points = np.concatenate([points_of(mesh) for mesh in meshes(stage)])
    look = stage.GetDefaultPrim().GetVariantSet("look").GetVariantSelection()
    for mesh in meshes(stage):
        low = ENVELOPE[0].copy()
        if look == "mockup":
            low[2] = MOCKUP_LOW.get(mesh.GetPath().name, low[2])
        assert (points_of(mesh) >= np.float32(low)).all(), mesh.GetPath()
    panel = points_of(UsdGeom.Mesh(stage.GetPrimAtPath(f"/Tango/{TOP}")))
    assert panel[:, 2].max() == np.float32(ENVELOPE[1, 2])
    assert (points[:, :2] <= ENVELOPE[1, :2]).all()
    official = np.array([point for _, point in OFFICIAL])
    assert (points.min(axis=0) <= official.min(axis=0)).all()
    assert (points.max(axis=0) >= np.float32(official.max(axis=0))).all()
