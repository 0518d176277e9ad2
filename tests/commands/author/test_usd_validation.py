"""What OpenUSD's validators and schemas say of authored stages, in every variant of each."""

from collections.abc import Iterator
from pathlib import PurePosixPath

import pytest
import trimesh
from pxr import Gf, Sdf, Usd, UsdGeom, UsdRender, UsdShade, UsdValidation

from spin_usd import author
from spin_usd.basics.resources import stages
from spin_usd.stage.author.variant_sets import VARIANT_SETS
from spin_usd.stage.composition.open_stage import open_as_it_is

TANGO = {"poses": stages() / "examples" / "tango_speedplus_poses.json", "frames": "0:2", "target": "tango"}
TEXTURES = stages() / "environments" / "textures"
STAGES = {
    "demo": TANGO,
    "augmentations": {**TANGO, "augment": "random_materials", "channels": "rgb"},
    "light": {**TANGO, "target": "capsule", "preset": "spin_synthetic", "background": TEXTURES},
    "lamps": {**TANGO, "target": "cubesat", "lights": "lightbox", "environment": "stars"},
    "trajectory": {
        "sample": "inspection", "count": 3, "target": "microsat", "environment": "earth", "augment": "isda"
    },
    "own model": {
        "sample": "range=4..8 inside=1 count=2", "units_per_metre": 1, "camera": ["speedplus", "spin:0.3,0,0"],
        "also": "cubesat:distance=1..5 count=2", "lidar": "flash", "range_finder": 0.03, "sun_direction": (1, 1, -1),
    },
}  # fmt: skip
WITHOUT_VALUE = ("outputs:",)
"""What attributes without a value begin with: they are sources that shaders connect to."""
ROUNDED = 1e-5  # metres: of points and corners in float32
LINEAR = Gf.ColorSpaceNames.LinearRec709

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=STAGES)
def stage(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Usd.Stage:
    folder, given = tmp_path_factory.mktemp("authored"), dict(STAGES[request.param])
    if "target" not in given:
        (folder / "keypoints.csv").write_text("name,x,y,z\ncorner,0.5,0.4,0.3\ntop,0,0,0.3\n")
        trimesh.creation.box((1.0, 0.8, 0.6)).export(folder / "craft.obj")
        given |= {"target": folder / "craft.obj", "keypoints": folder / "keypoints.csv"}
    return open_as_it_is(author(**{"camera": "speedplus", **given}, out=folder / "stage").root)


def in_each_variant(stage: Usd.Stage) -> Iterator[str]:
    """Select each variant of each of the world's sets in turn, in the session layer."""
    yield "as authored"
    sets = stage.GetDefaultPrim().GetVariantSets()
    assert set(VARIANT_SETS) <= set(sets.GetNames())
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for name in sets.GetNames():
            for variant in sets.GetVariantSet(name).GetVariantNames():
                sets.GetVariantSet(name).SetVariantSelection(variant)
                yield f"{name}={variant}"
            sets.GetVariantSet(name).ClearVariantSelection()


def properties(stage: Usd.Stage) -> Iterator[Usd.Property]:
    """All that is authored."""
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        yield from prim.GetAuthoredProperties()


def test_no_validator_of_openusd_finds_anything(stage: Usd.Stage) -> None:
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    for variant in in_each_variant(stage):
        found = [f"{error.GetIdentifier()} {error.GetMessage()}" for error in context.Validate(stage)]
        assert found == [], variant


def test_what_is_authored_has_a_value_and_what_is_named_is_there(stage: Usd.Stage) -> None:
    for variant in in_each_variant(stage):
        for each in properties(stage):
            if isinstance(each, Usd.Relationship):
                assert all(map(stage.GetObjectAtPath, each.GetTargets())), (variant, each.GetPath())
            elif not each.GetName().startswith(WITHOUT_VALUE):
                assert each.HasValue() or each.GetConnections(), (variant, each.GetPath())


def test_what_is_authored_is_as_its_schema_has_it(stage: Usd.Stage) -> None:
    """Of the type and variability, one of the allowed tokens, and not custom."""
    compared = 0
    for variant in in_each_variant(stage):
        for each in properties(stage):
            there = each.GetPrim().GetPrimDefinition().GetAttributeDefinition(each.GetName())
            if isinstance(each, Usd.Attribute) and there:
                where, compared = (variant, each.GetPath()), compared + 1
                assert each.GetTypeName() == there.GetTypeName(), where
                assert {spec.variability for spec in each.GetPropertyStack()} == {there.GetVariability()}, where
                assert not each.IsCustom(), where
                assert each.Get() in (there.GetMetadata("allowedTokens") or [each.Get()]), where
    assert compared > 100


def test_points_and_meshes_have_the_extent_that_usd_computes(stage: Usd.Stage) -> None:
    seen = 0
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.PointBased):
            shape, seen = UsdGeom.Boundable(prim), seen + 1
            own = UsdGeom.Boundable.ComputeExtentFromPlugins(shape, Usd.TimeCode.Default())
            assert all(map(Gf.IsClose, shape.GetExtentAttr().Get(), own, [ROUNDED] * 2)), prim.GetPath()
    assert seen


def test_usd_knows_the_colour_space_of_every_colour(stage: Usd.Stage) -> None:
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    assert settings.GetRenderingColorSpaceAttr().Get() == LINEAR
    attributes = [each for each in properties(stage) if isinstance(each, Usd.Attribute)]
    colours = [each for each in attributes if each.GetRoleName() == Sdf.ValueRoleNames.Color]
    assert {str(Usd.ColorSpaceAPI.ComputeColorSpaceName(each, None)) for each in colours} == {LINEAR}
    images = [UsdShade.Shader(prim).GetInput("file") for prim in stage.Traverse() if prim.IsA(UsdShade.Shader)]
    for each in filter(None, images):  # whose own word counts before that of the prims above
        assert each.GetPrim().GetAttribute("inputs:sourceColorSpace").Get() in ("raw", "sRGB"), each.GetFullName()


def test_every_product_is_a_file_of_its_own_beside_the_others(stage: Usd.Stage) -> None:
    products = [UsdRender.Product(prim) for prim in stage.Traverse() if prim.IsA(UsdRender.Product)]
    names = [product.GetProductNameAttr().Get() for product in products]
    assert len(set(names)) == len(products) > 1
    assert all(name.startswith("./") and PurePosixPath(name).suffix == ".exr" for name in names)
    targets = UsdRender.Settings.GetStageRenderSettings(stage).GetProductsRel().GetTargets()
    assert set(targets) == {product.GetPath() for product in products}
