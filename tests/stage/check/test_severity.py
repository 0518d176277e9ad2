"""What others wrote and what renders right is a warning at most; single precision is told of where it is seen."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from pxr import UsdGeom

from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.composition.open_stage import open_stage

Make: TypeAlias = Callable[..., Path]

FORM = {
    "kind-broken": 'def Cube "Box" (\n kind = "component"\n)\n{\n}',
    "ShaderSdrCompliance": """def Cube "Box"
{
}
def Shader "Reader"
{
    uniform token info:id = "UsdPrimvarReader_float2"
    token inputs:varname = "st"
    float2 outputs:result
}""",
    "MaterialBindingApiApplied": """def Cube "Box"
{
    rel material:binding = </World/Target/Look>
}
def Material "Look"
{
    token outputs:surface.connect = </World/Target/Look/Surface.outputs:surface>
    def Shader "Surface"
    {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}""",
    "variant-dead": """def Cube "Box" (
    variants = {
        string size = "small"
    }
    prepend variantSets = "size"
)
{
    double size = 1
    variantSet "size" = {
        "small" {
            double size = 2
        }
    }
}""",
    "variant-unknown": """def Cube "Box" (
    variants = {
        string size = "none"
    }
    prepend variantSets = "size"
)
{
    variantSet "size" = {
        "small" {
        }
    }
}""",
    "light": 'def Cube "Box"\n{\n}\ndef DistantLight "Lamp"\n{\n}',
}


@pytest.mark.parametrize("code", FORM)
def test_the_form_of_what_is_rendered_right_is_a_warning(make_stage: Make, code: str) -> None:
    found = check_stage(make_stage(FORM[code]))
    assert {finding.severity for finding in found if code in finding.code} == {"warning"}
    assert {finding.code for finding in found if finding.severity == "error"} == set()


def test_a_dead_augmentation_stays_an_error(make_stage: Make) -> None:
    path = make_stage()
    dead = """    prepend variantSets = "augmentation"
)
{
    variantSet "augmentation" = {
        "near" {
            over "Target"
            {
                double3 xformOp:translate = (0, 0, -5)
            }
        }
    }
"""
    path.write_text(path.read_text().replace('def Xform "World"\n{', f'def Xform "World" (\n{dead}', 1))
    assert ("variant-dead", "error") in {(finding.code, finding.severity) for finding in check_stage(path)}


def posed(make_stage: Make, camera: tuple[float, ...], target: tuple[float, ...]) -> set[str]:
    """The codes of findings on a stage posed as usd-core's own UsdGeom.XformCommonAPI does."""
    path = make_stage(pose="", name=f"{len(camera) + abs(hash(camera))}.usda")
    stage = open_stage(path)
    for name, place in (("Camera", camera), ("Target", target)):
        prim: Any = UsdGeom.Xformable(stage.GetPrimAtPath(f"/World/{name}"))
        prim.AddTranslateOp(UsdGeom.XformOp.PrecisionFloat).Set(place)
        prim.AddRotateXYZOp().Set((60, 0, 30) if name == "Target" else (0, 0, 0))
    stage.GetRootLayer().Save()
    return {finding.code for finding in check_stage(path)}


def test_the_ordinary_operations_of_usd_are_precise_enough(make_stage: Make) -> None:
    assert "pose-precision" not in posed(make_stage, (0, 0, 0), (0, 0, -1000))


def test_single_precision_is_told_of_where_the_origin_is_far(make_stage: Make) -> None:
    """In an orbit a float is 0.5 m from the next, and the target 10 m from the camera."""
    assert "pose-precision" in posed(make_stage, (7e6, 0, 0), (7e6, 0, -10))
