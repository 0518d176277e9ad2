"""The variant sets `camera`, `environment` and `materials` of an authored stage, each with the variants plain and rich.

They reproduce the published ablation. The variants reference layers of `stages/augmentations`; no variant is selected,
so the stage stays as authored until an augmentation selects some.
"""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf

from spin_usd.basics.resources import stages
from spin_usd.errors import InputError
from spin_usd.stage.author.diffuse_materials import DISPLAYED, DiffuseOverrides, author_diffuse_materials
from spin_usd.stage.author.paths import CAMERA, ENVIRONMENT, LIGHTS, MODEL, WORLD
from spin_usd.stage.author.presets import Preset, open_preset
from spin_usd.stage.composition.copy_stage import copy_assets
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import author_metadata, export

VARIANT_SETS = ("camera", "environment", "materials")
PLAIN, RICH = "plain", "rich"
LAYER = "variant_sets.usda"
FOLDER = "variant_sets"
SURROUNDINGS = (LIGHTS, ENVIRONMENT)
SURROUNDINGS_TYPES = ("", "Xform", "Scope")  # of a root that is itself neither a light nor a background
BEHIND = (schema.PLANET_API, schema.STARS_API, schema.BACK_PLATE_API)

DOCUMENTATION = """Three variant sets of /World, each with the variants plain and rich; none is selected here.
camera: sensor, optics and exposure, never the lens. environment: the stage's own lights and surroundings are switched
off, and others come in. materials: {materials}
Their contents are in variant_sets/plain.usda and variant_sets/rich.usda."""
SELECTED = "the target's own variants of its set look."
OVERRIDDEN = """the target has no variants of these names. In plain, its materials are made diffuse; rich has no
opinions, because the target is rich as it was modelled."""


def write_variant_sets(
    folder: Path,
    surroundings: Mapping[Sdf.Path, Sdf.Layer],
    variants: Mapping[str, tuple[str, ...]],
    overrides: DiffuseOverrides,
) -> None:
    """Write the layer with the three sets, and the files it refers to, into `folder`.

    Raises InputError for surroundings that cannot be switched off, OutputError.

    Args:
        surroundings: The stage's own layers of LIGHTS and ENVIRONMENT.
        variants: The target's variant sets with their variants.
        overrides: Opinions that make its materials diffuse if it lacks variants of these names.
    """
    kinds = {name: open_preset(stages() / "augmentations" / f"{name}.usda") for name in (PLAIN, RICH)}
    selectable = all(_has(variants, kind.selections) for kind in kinds.values())
    layer = Sdf.Layer.CreateAnonymous(".usda")
    documentation = DOCUMENTATION.format(materials=SELECTED if selectable else OVERRIDDEN)
    author_metadata(layer, default_prim=WORLD.name, documentation=documentation)
    world = Sdf.CreatePrimInLayer(layer, WORLD)
    for name, kind in kinds.items():
        _write_kind(kind, folder / FOLDER)
        _reference(_over(world, "camera", name, CAMERA), name)
        for path in SURROUNDINGS:
            place = _over(world, "environment", name, path)
            _reference(place, name)
            _switch_off(place, _children(surroundings[path], kind, path))
        if selectable:
            _over(world, "materials", name, MODEL).variantSelections.update(kind.selections)
        elif name == PLAIN:
            model = _over(world, "materials", name, MODEL)
            author_diffuse_materials(model, model.path.ReplaceName(DISPLAYED), overrides)
        else:
            _variant(world, "materials", name)
    world.variantSetNameList.prependedItems[:] = VARIANT_SETS  # they share no attribute, so any order works
    export(layer, folder / LAYER)


def _write_kind(kind: Preset, folder: Path) -> None:
    """Write the layer that a variant of each set references, with its files."""
    _add_schemas(kind.flat.GetPrimAtPath(CAMERA))
    copy_assets(kind.flat, folder / kind.file.stem)
    export(kind.flat, folder / kind.file.name)


def _add_schemas(camera: Sdf.PrimSpec) -> None:
    """Prepend its schemas to the camera's own: the flattened list is explicit and would replace them."""
    schemas = Sdf.TokenListOp()
    schemas.prependedItems = camera.GetInfo("apiSchemas").GetAddedOrExplicitItems()
    camera.SetInfo("apiSchemas", schemas)


def _has(variants: Mapping[str, tuple[str, ...]], selections: Mapping[str, str]) -> bool:
    return all(variant in variants.get(name, ()) for name, variant in selections.items())


def _variant(world: Sdf.PrimSpec, set_name: str, name: str) -> Sdf.PrimSpec:
    return Sdf.CreateVariantInLayer(world.layer, world.path, set_name, name).primSpec


def _over(world: Sdf.PrimSpec, set_name: str, name: str, path: Sdf.Path) -> Sdf.PrimSpec:
    """Return the prim at `path`, below /World, within the variant."""
    variant = _variant(world, set_name, name)
    return Sdf.CreatePrimInLayer(world.layer, path.ReplacePrefix(WORLD, variant.path))


def _reference(prim: Sdf.PrimSpec, kind: str) -> None:
    """Reference the prim of the same path in the layer of the variants named `kind`."""
    prim.referenceList.Prepend(Sdf.Reference(f"./{FOLDER}/{kind}.usda", prim.path.StripAllVariantSelections()))


def _switch_off(over: Sdf.PrimSpec, names: tuple[str, ...]) -> None:
    for name in names:
        Sdf.CreatePrimInLayer(over.layer, over.path.AppendChild(name)).active = False


def _children(layer: Sdf.Layer, kind: Preset, path: Sdf.Path) -> tuple[str, ...]:
    """Return the prims' names in a layer of surroundings. Raises InputError where they cannot be switched off by
    name."""
    stage = stage_on(layer)
    root = stage.GetDefaultPrim()
    if root.GetTypeName() not in SURROUNDINGS_TYPES or any(root.HasAPI(api) for api in BEHIND):
        found = "is itself a light or a background, which no variant of the stage can switch off"
        raise InputError(found, where=f"{path.name} /{root.GetName()}", do="put it below an Xform of that name")
    names = tuple(child.GetName() for child in root.GetChildren())
    for name in names:
        if kind.flat.GetPrimAtPath(path.AppendChild(name)):
            found = f"has the same name as a prim of the stage's variant environment={kind.file.stem} brings in"
            raise InputError(found, where=f"{path.name} /{root.GetName()}/{name}", do="give it another name")
    return names
