"""Presets: layers with the settings of a kind of pictures: camera attributes, lights, environment, materials.

A preset's default prim is World, with any of the children Camera (sensor, exposure, optics, focus: not the lens),
Lights, Environment and Target/Model (variant selections). A preset changes nothing else.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf

from spin_usd.errors import InputError
from spin_usd.stage.author.lights_and_environment import composed, extracted
from spin_usd.stage.author.paths import CAMERA, ENVIRONMENT, LIGHTS, MODEL, TARGET, WORLD
from spin_usd.stage.composition.open_layer import open_layer, stage_on

EMPTY = (WORLD, TARGET, MODEL)  # prims on which a preset authors no properties
PREFIXES = ("spin:sensor:", "spin:optics:", "exposure:", "shutter:")
NAMES = ("exposure", "fStop", "focusDistance")


@dataclass(frozen=True, kw_only=True, eq=False)
class Preset:
    """A composed preset."""

    file: Path
    flat: Sdf.Layer
    """All that its layers compose, asset paths absolute."""
    selections: Mapping[str, str]
    """Variant set -> variant of the target."""

    def layer(self, prim: Sdf.Path) -> Sdf.Layer | None:
        """Return its opinions on LIGHTS or ENVIRONMENT as a layer of its own; None where it has none."""
        if not self.flat.GetPrimAtPath(prim):
            return None
        return extracted(self.flat, prim, self.flat.documentation)

    def chosen(self, variants: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
        """Return its selections among the `variants` of a target, without what the target lacks: a preset is made with
        one craft, and used with any."""
        return {name: variant for name, variant in self.selections.items() if variant in variants.get(name, ())}

    def set_camera(self, layer: Sdf.Layer) -> None:
        """Write its camera attributes over a camera layer's."""
        source = self.flat.GetPrimAtPath(CAMERA)
        if not source:
            return
        stage = stage_on(layer)
        camera = stage.GetDefaultPrim()
        for schema in source.GetInfo("apiSchemas").GetAddedOrExplicitItems() if source.HasInfo("apiSchemas") else ():
            camera.AddAppliedSchema(schema)
        camera.SetDocumentation(source.GetInfo("documentation"))
        note = f"Sensor, exposure, optics and focus are from the preset {self.file.stem} instead."
        layer.documentation = f"{layer.documentation}\n{note}"
        for attribute in source.properties:
            Sdf.CopySpec(self.flat, attribute.path, layer, camera.GetPath().AppendProperty(attribute.name))


def open_preset(path: str | Path) -> Preset:
    """Compose the preset in the layer at `path`. Raises InputError that names the file and the prim at fault."""
    file = Path(path)
    layer = open_layer(file)
    flat = composed(layer, path)
    stage = stage_on(layer)
    if layer.defaultPrim != WORLD.name or not stage.GetPrimAtPath(WORLD):
        raise InputError("is not a preset: its default prim is not World", where=path, do="see stages/presets")
    model = stage.GetPrimAtPath(MODEL)
    selections = dict(model.GetVariantSets().GetAllVariantSelections()) if model else {}
    flat.documentation = layer.documentation
    for prim in (p for root in flat.rootPrims for p in _tree(root)):
        _check(prim, file)
    return Preset(file=file, flat=flat, selections=selections)


def _tree(prim: Sdf.PrimSpec) -> list[Sdf.PrimSpec]:
    """Return the prim and all below it, except below lights and environment, which may hold anything."""
    below = [] if prim.path in (LIGHTS, ENVIRONMENT) else [p for child in prim.nameChildren for p in _tree(child)]
    return [prim, *below]


def _check(prim: Sdf.PrimSpec, file: Path) -> None:
    """Raise InputError for a prim or property that would be missing from the authored stage."""
    where = f"{file} {prim.path}"
    if prim.path not in (*EMPTY, CAMERA, LIGHTS, ENVIRONMENT):
        do = "keep to Camera, Lights, Environment and Target/Model below World"
        raise InputError("is a prim that a preset cannot have", where=where, do=do)
    for attribute in prim.properties if prim.path in EMPTY else ():
        raise InputError(f"has {attribute.name}, which a preset cannot set", where=where, do="remove it")
    for attribute in prim.properties if prim.path == CAMERA else ():
        if attribute.name not in NAMES and not attribute.name.startswith(PREFIXES):
            found = f"has {attribute.name}, which belongs to the camera"
            raise InputError(found, where=where, do="put it into a camera layer, and give that as --camera")
