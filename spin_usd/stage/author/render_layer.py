"""UsdRender's description of the output: resolution, products, and one variable for each label."""

from collections.abc import Mapping

from pxr import Gf, Sdf, Usd, UsdGeom, UsdRender

from spin_usd.geometry.camera import Camera
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.usd.layer_file import author_metadata

SETTINGS = Sdf.Path("/Render/Settings")


def render_layer(camera: Camera, outputs: Mapping[str, str]) -> Sdf.Layer:
    """Make an anonymous layer with /Render: a product for each of `outputs`, which gives a pixel's USD type by name.
    Its camera is set by the layer that references it, since it lies outside."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim="Render", documentation="What is rendered: resolution, products, labels.")
    stage = stage_on(layer)
    UsdGeom.Scope.Define(stage, "/Render")
    UsdGeom.Scope.Define(stage, "/Render/Products")
    UsdGeom.Scope.Define(stage, "/Render/Vars")
    settings = UsdRender.Settings.Define(stage, SETTINGS)
    settings.CreateResolutionAttr(Gf.Vec2i(camera.width, camera.height))
    settings.CreatePixelAspectRatioAttr(camera.fy / camera.fx)
    settings.CreateIncludedPurposesAttr([UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    settings.CreateProductsRel().SetTargets([_product(stage, name, kind) for name, kind in outputs.items()])
    return layer


def _product(stage: Usd.Stage, name: str, kind: str) -> Sdf.Path:
    """Define a product of one variable: each label is a file of its own."""
    variable = UsdRender.Var.Define(stage, f"/Render/Vars/{name}")
    variable.CreateDataTypeAttr(kind)
    variable.CreateSourceNameAttr(name)
    variable.CreateSourceTypeAttr(UsdRender.Tokens.raw)
    product = UsdRender.Product.Define(stage, f"/Render/Products/{name}")
    product.CreateProductTypeAttr(UsdRender.Tokens.raster)
    product.CreateProductNameAttr(name)
    product.CreateOrderedVarsRel().SetTargets([variable.GetPath()])
    return product.GetPath()
