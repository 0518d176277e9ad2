"""The stand-ins: the committed layers are what the script writes, and sound USD with labels, looks and keypoints."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom, UsdSemantics, UsdShade, UsdValidation

from tests.conftest import REPOSITORY

TARGETS = REPOSITORY / "stages" / "targets"
# Edges of the box around each, metres: the CubeSat standard's rails and the antennas; Proba-2's body and wings; 7 m.
SIZES = {"cubesat": (0.1, 0.1, 0.16), "microsat": (1.98, 0.7, 1.06), "capsule": (10.6, 3.45, 7.3)}
BODIES = {"cubesat": (0.1, 0.1, 0.1135), "microsat": (0.60, 0.70, 0.85)}
ROUNDING = 1e-4  # the hint's decimals


def opened(name: str, look: str = "reflective") -> Usd.Stage:
    stage = Usd.Stage.Open(str(TARGETS / name / f"{name}.usda"))
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        stage.GetDefaultPrim().GetVariantSet("look").SetVariantSelection(look)
    return stage


def gprims(stage: Usd.Stage) -> list[Usd.Prim]:
    return [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.Points)]


@pytest.mark.campaign
def test_the_committed_layers_are_what_the_script_writes(tmp_path: Path) -> None:
    subprocess.run([sys.executable, REPOSITORY / "tools" / "build_stand_ins", tmp_path], check=True)
    for name in SIZES:
        assert (tmp_path / name / f"{name}.usda").read_text() == (TARGETS / name / f"{name}.usda").read_text()


@pytest.mark.parametrize("look", ["matt", "reflective"])
@pytest.mark.parametrize("name", SIZES)
def test_usd_finds_nothing_to_complain_about(name: str, look: str) -> None:
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    assert [error.GetMessage() for error in context.Validate(opened(name, look))] == []


@pytest.mark.parametrize("name", SIZES)
def test_it_is_as_large_as_what_it_stands_for(name: str) -> None:
    stage = opened(name)
    prim = stage.GetDefaultPrim()
    box = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(prim).ComputeAlignedRange()
    assert list(box.GetSize()) == pytest.approx(SIZES[name], abs=0.02 * max(SIZES[name]))
    hint = np.array(UsdGeom.ModelAPI(prim).GetExtentsHint())
    assert hint == pytest.approx(np.array([box.GetMin(), box.GetMax()]), abs=ROUNDING)
    assert prim.GetKind() == "component"


@pytest.mark.parametrize("name", BODIES)
def test_the_first_eight_keypoints_are_the_corners_of_its_body(name: str) -> None:
    stage = opened(name)
    points = UsdGeom.Points(stage.GetDefaultPrim().GetChild("Keypoints"))
    places = np.array(points.GetPointsAttr().Get())
    assert np.ptp(places[:8], axis=0) == pytest.approx(BODIES[name])
    assert list(points.GetIdsAttr().Get()) == list(range(1, len(places) + 1))
    assert points.GetPurposeAttr().Get() == "guide"


@pytest.mark.parametrize("name", SIZES)
def test_boxes_are_closed_and_inside_out_nowhere(name: str) -> None:
    stage = opened(name)
    meshes = [UsdGeom.Mesh(prim) for prim in gprims(stage) if prim.IsA(UsdGeom.Mesh)]
    for mesh in meshes:
        quads = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 4)
        faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        surface = trimesh.Trimesh(np.array(mesh.GetPointsAttr().Get()), faces, process=False)
        assert surface.is_watertight
        assert surface.is_winding_consistent
        assert min(part.volume for part in surface.split()) > 0, mesh.GetPath()


@pytest.mark.parametrize("name", SIZES)
def test_every_part_has_its_labels_and_a_material_in_both_looks(name: str) -> None:
    for look in ("matt", "reflective"):
        stage = opened(name, look)
        prims = gprims(stage)
        parts = [UsdSemantics.LabelsAPI(prim, "part").GetLabelsAttr().Get()[0] for prim in prims]
        assert len(set(parts)) == len(parts) > 5
        for prim in prims:
            assert UsdSemantics.LabelsAPI(prim, "class").GetLabelsAttr().Get()[0]
            material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
            assert material.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"
