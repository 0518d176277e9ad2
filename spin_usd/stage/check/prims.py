"""Rules on prims: kinds, labels, lights, extents, draw modes."""

from collections.abc import Iterator
from difflib import get_close_matches
from functools import cache

import numpy as np
from pxr import Kind, Usd, UsdGeom, UsdLux, UsdSemantics

from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.stage.author.camera_layer import SOLAR_IRRADIANCE
from spin_usd.stage.read.lights import visible_lights
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.draw_modes import stand_ins
from spin_usd.stage.usd.transforms import EDITED, SAMPLED
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import ancestors

BRIGHTNESS = ((SOLAR_IRRADIANCE / 50, "nearly black"), (SOLAR_IRRADIANCE * 2, "about as bright as with it"))
"""Below each irradiance, W/m2: the appearance of a picture that is exposed for the Sun."""
LIGHT_INPUTS = ("inputs:intensity", "inputs:normalize")  # other programs have other fallbacks for them

NAMESPACE = "spin:"


def kind_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """A model's ancestors are all groups, or USD does not see it as a model."""
    for prim in stage.Traverse():
        kind = Usd.ModelAPI(prim).GetKind()
        if kind and Kind.Registry.IsA(kind, Kind.Tokens.model) and not prim.IsModel():
            yield Finding(
                code="kind-broken",
                where=str(prim.GetPath()),
                message=f"has kind {kind}, but not every ancestor is a group or an assembly, so USD does not see a "
                "model; give all of those such a kind, or remove this one",
                severity=WARNING,
            )


def label_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Every surface of the target has a class, its own or inherited."""
    for target in stage.Traverse():
        if not target.HasAPI(schema.TARGET_API):
            continue
        for prim in Usd.PrimRange(target, Usd.TraverseInstanceProxies()):
            if _is_surface(prim) and not _labelled(prim, target):
                yield Finding(
                    code="label-none",
                    where=str(prim.GetPath()),
                    message=f"has no {schema.CLASS_LABELS}, its own or inherited, so its class is unknown in every "
                    "picture; label it, or a prim above it",
                    severity=WARNING,
                )


def light_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Lights author the inputs that decide their power, and a Sun is not dark. A dome's fallbacks are plain; a distant
    light's intensity, 50,000, is not the Sun's and never meant, except for a light that came with a target."""
    for prim in stage.Traverse():
        if not prim.HasAPI(UsdLux.LightAPI) or prim.IsA(UsdLux.DomeLight) or prim.IsA(UsdLux.DomeLight_1):
            continue
        missing = [name for name in LIGHT_INPUTS if not prim.GetAttribute(name).HasAuthoredValue()]
        if missing or _dark_unless_normalised(prim):
            wrong = prim.IsA(UsdLux.DistantLight) and "inputs:intensity" in missing and not _of_target(prim)
            problem = f"does not author {' and '.join(missing)}" if missing else "authors inputs:normalize = 0"
            message = f"the light {problem}, so {_effect(prim, missing)}"
            severity = ERROR if wrong else WARNING
            yield Finding(code="light", where=str(prim.GetPath()), message=message, severity=severity)


def light_unit_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Lights that can be visible are all in watts if one is: UsdLux's own units are lux, nits and candelas."""
    units = {str(prim.GetPath()): prim.GetCustomDataByKey(schema.INTENSITY_UNIT) for prim in visible_lights(stage)}
    ours = next((f"{unit} of {path}" for path, unit in units.items() if unit in schema.INTENSITY_UNITS), None)
    for path, unit in units.items():
        if unit not in schema.INTENSITY_UNITS and ours:
            says = "does not state the unit of its intensity" if unit is None else f"has its intensity in {unit}"
            message = f"{says}, and it is rendered beside {ours}"
            do = f"convert it, and author customData {schema.INTENSITY_UNIT}: {', '.join(schema.INTENSITY_UNITS)}"
            yield Finding(code="light-unit", where=path, message=f"{message}; {do}", severity=WARNING)


def extent_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Everything with points that is rendered authors its extent."""
    for prim in stage.Traverse():
        if (
            prim.IsA(UsdGeom.PointBased)
            and _is_rendered(prim)
            and not UsdGeom.Boundable(prim).GetExtentAttr().HasAuthoredValue()
        ):
            message = "has no extent, so viewers must read all its points to frame it; author extent"
            yield Finding(code="extent-none", where=str(prim.GetPath()), message=message, severity=WARNING)


def xform_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Every transform operation is in its prim's order, or it moves nothing. A target's own file is its maker's."""
    for prim in stage.Traverse():
        names = [name for name in prim.GetAuthoredPropertyNames() if name.startswith("xformOp:")]
        order = {*(read(prim.GetAttribute("xformOpOrder")) or ())} if names else set()
        unread = [name for name in names if not {name, f"!invert!{name}"} & order]
        replaced = any(name.endswith((EDITED, SAMPLED)) for name in order)  # on purpose, by sampling or by a log
        if unread and not replaced and not _of_target(prim):
            message = f"its xformOpOrder leaves out {', '.join(unread)}, so that moves nothing; put it in, or remove it"
            yield Finding(code="xform-unread", where=str(prim.GetPath()), message=message, severity=WARNING)


def _effect(prim: Usd.Prim, missing: list[str]) -> str:
    """Describe the consequence of inputs that the light does not author, and the remedy."""
    if not prim.IsA(UsdLux.DistantLight):
        effects = {"inputs:intensity": "its intensity is 1", "inputs:normalize": "its light grows with its area"}
        return f"{' and '.join(effects[name] for name in missing)}; author the intended value"
    watts = irradiance(prim)
    appearance = next((text for limit, text in BRIGHTNESS if watts < limit), "white")
    return (
        f"it gives {watts:.3g} W/m2 where the Sun gives {SOLAR_IRRADIANCE:g}, and pictures that are exposed for the "
        f"Sun are {appearance}; author inputs:normalize = 1 and as inputs:intensity the irradiance in W/m2"
    )


def _dark_unless_normalised(prim: Usd.Prim) -> bool:
    """Return whether it is a distant light whose intensity is a radiance, too small for the size of its disk."""
    return prim.IsA(UsdLux.DistantLight) and not _normalised(prim) and 0 < irradiance(prim) < BRIGHTNESS[0][0]


def irradiance(prim: Usd.Prim) -> float:
    """Compute the irradiance, W/m2, of a white distant light at its default time: see `stage.read.distant_light`."""
    light = UsdLux.LightAPI(prim)
    half = np.radians(float(read(prim.GetAttribute("inputs:angle")))) / 2
    size = 1.0 if half == 0 or _normalised(prim) else np.pi * np.sin(half) ** 2
    return float(read(light.GetIntensityAttr()) * np.exp2(read(light.GetExposureAttr())) * size)


def _normalised(prim: Usd.Prim) -> bool:
    return bool(read(UsdLux.LightAPI(prim).GetNormalizeAttr()))


def _of_target(prim: Usd.Prim) -> bool:
    return any(above.HasAPI(schema.TARGET_API) for above in ancestors(prim))


def draw_mode_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Other programs show a model's geometry, as pictures do."""
    for prim, mode in stand_ins(stage.GetPseudoRoot()):
        message = f"asks to be shown as {mode}, as other programs do; a picture shows its geometry"
        yield Finding(code="draw-mode", where=str(prim.GetPath()), message=message, severity=WARNING)


def _is_surface(prim: Usd.Prim) -> bool:
    gprim = prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.Points) and not prim.IsA(UsdGeom.Curves)
    return bool(gprim and _is_rendered(prim))


def _is_rendered(prim: Usd.Prim) -> bool:
    return UsdGeom.Imageable(prim).ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)


def _labelled(prim: Usd.Prim, target: Usd.Prim) -> bool:
    while prim and prim != target.GetParent():
        attribute = UsdSemantics.LabelsAPI(prim, "class").GetLabelsAttr() if prim else None
        if attribute and attribute.HasAuthoredValue():
            return True
        prim = prim.GetParent()
    return False


def property_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Every authored spin:* property is one that the schema defines."""
    for prim in stage.Traverse():
        for name in prim.GetAuthoredPropertyNames():
            if name.startswith(NAMESPACE) and name not in _defined():
                near = get_close_matches(name, sorted(_defined()), n=1)
                hint = f": is {near[0]} meant?" if near else "; remove it"
                message = f"no schema defines {name}, so it does nothing{hint}"
                yield Finding(code="property-unknown", where=str(prim.GetPath()), message=message, severity=WARNING)


@cache
def _defined() -> frozenset[str]:
    registry = Usd.SchemaRegistry()
    definitions = [registry.FindAppliedAPIPrimDefinition(name) for name in schema.APIS]
    return frozenset(name for definition in definitions for name in definition.GetPropertyNames())
