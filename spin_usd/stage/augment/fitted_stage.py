"""A stage with the lights, the camera and the surfaces that were fitted to real pictures, as layers over a copy of it.

Fits are local opinions: they hold in all variants of the stage, and its other values stay. Between two pictures with a
fit, a frame without one has interpolated light and camera; lights stand around its own target.
"""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from pxr import Gf, Sdf

from spin_usd import __version__
from spin_usd.basics.arrays import Float
from spin_usd.basics.unique_names import UniqueNames
from spin_usd.errors import InputError, OutputError, UnsupportedError
from spin_usd.scene.derived.light_groups import emission_of
from spin_usd.scene.light import CylinderLight, DistantLight, Light, RectLight, SphereLight
from spin_usd.scene.scene import FrameId, Scene
from spin_usd.stage.augment.attribute_change import BaseStage, ChangedAttribute, attribute_of
from spin_usd.stage.augment.lights import rotation_of_z
from spin_usd.stage.augment.parameters import PARAMETERS
from spin_usd.stage.augment.replace_files import FOLDER, REPEATED, repeat
from spin_usd.stage.augment.sampled_values import SampledValue, SampledValues, open_base, sampled_values, write_values
from spin_usd.stage.composition.copy_stage import copy_stage
from spin_usd.stage.composition.open_layer import open_layer
from spin_usd.stage.read.camera import find_cameras
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import quatd, unique_identifiers, vec3d
from spin_usd.stage.usd.layer_file import export

ROOT, STAGE, LIGHTS = "dataset.usda", "stage", "FittedLights"
FITS = {
    "light": "Lights as fitted to real pictures. The stage's own are hidden, from planets too.",
    "camera": "Sensor and optics as fitted to real pictures.",
    "surface": "Surfaces as fitted to real pictures.",
}
"""Documentation of the layer of each kind of fit, the strongest layer first."""
SET, OWN = "fitted_light", "own"
"""The variant set of the lights, and its variant in which each picture has its own strengths; the others give all
frames those of one picture, and have its frame's name."""
CAMERA = [name for name in PARAMETERS if name.startswith(("sensor.", "optics.")) and name != "optics.vignetting"]
"""Parameters of the camera that are written: fields of a scene's `sensor` and `optics`."""
DIGITS = 12  # of stage units and quaternions: a light that keeps its place around the target has one value
Attributes: TypeAlias = dict[tuple[str, str], Any]
"""Values of a prim, by the attribute's name and type."""
TRANSLATE, ORIENT = ("xformOp:translate", "double3"), ("xformOp:orient", "quatd")
ORDER = ("xformOpOrder", "token[]")
LIGHT_TYPES = (DistantLight, RectLight, SphereLight, CylinderLight)  # with the names that USD has for them


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedPicture:
    """A picture as it was fitted."""

    frame: FrameId
    """The stage's frame."""
    scene: Scene
    """The stage's scene with the lights, the sensor and the optics that were fitted."""


def write_fits(
    root: Path, folder: Path, pictures: Sequence[FittedPicture], *, fits: Collection[str], values: Mapping[str, float]
) -> Path:
    """Write `fits`, some of FITS, over a copy in `folder` of the stage at `root`; return the root layer there.

    pictures: at least one, of the nominal variant; their exposure stays the stage's. values: parameters of surfaces, as
    augmentations have them. Raises InputError for what the stage does not have, UnsupportedError for a light that
    cannot be written, StageError, and OutputError where `folder` has such files.
    """
    if taken := next((file for name in (ROOT, FOLDER, STAGE) if (file := folder / name).exists()), None):
        raise OutputError("exists already", where=taken, do="give a new folder")
    original, reader, layers = open_layer(root), StageReader(root, check_images=False), []
    base, _, _ = open_base(reader.stage)
    for fit in (fit for fit in FITS if fit in fits):
        layers.append((f"./{FOLDER}/{fit}.usda", layer := _headed(original, FITS[fit], {schema.FIT: fit})))
        if fit == "light":
            _author_lights(layer, reader, base, pictures)
        elif fit == "camera":
            write_values(layer, _camera(reader, base, pictures))
        else:
            write_values(layer, sampled_values(base, values, {}))
    top = _headed(original, f"{root.name} as fitted to real pictures.", {})
    repeat(original, top, REPEATED)
    top.subLayerPaths = [*(name for name, _ in layers), f"./{STAGE}/{root.name}"]
    copy_stage(root, folder / STAGE)
    for name, layer in (*layers, (ROOT, top)):
        export(layer, folder / name)
    return folder / ROOT


def _headed(root: Sdf.Layer, documentation: str, provenance: dict[str, str]) -> Sdf.Layer:
    """Make a layer with the metadata that every layer repeats from the stage's root."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    repeat(root, layer, [name for name in REPEATED if name != "renderSettingsPrimPath"])
    layer.documentation = documentation
    layer.customLayerData = {schema.PROVENANCE: {"version": __version__, **provenance}}
    return layer


def _camera(reader: StageReader, base: BaseStage, pictures: Sequence[FittedPicture]) -> SampledValues:
    """Return the values of CAMERA that differ from the stage's, and no metering where the pictures have none."""
    pairs = [(reader.scene(each.frame), each.scene) for each in pictures]
    constant: dict[str, Any] = {}
    per_frame: dict[str, list[Any]] = {}
    if any(own.sensor.auto_exposure and not fitted.sensor.auto_exposure for own, fitted in pairs):
        metered = (prim for prim in find_cameras(reader.stage).values() if prim.HasAPI(schema.SENSOR_API))
        constant = {f"{prim.GetPath()}.{schema.AUTO_EXPOSURE}": False for prim in metered}
    for name in CAMERA:
        of = attrgetter(name)
        values = [of(fitted) for _, fitted in pairs]
        if len(set(values)) > 1:
            per_frame[name] = values
        elif any(of(own) != values[0] for own, _ in pairs):
            constant[name] = values[0]
    times = tuple(base.times[each.frame.index] for each in pictures)
    return sampled_values(replace(base, times=times), constant, per_frame)


def _author_lights(layer: Sdf.Layer, reader: StageReader, base: BaseStage, pictures: Sequence[FittedPicture]) -> None:
    """Author a prim for each light that shines in any picture, by the light's path, and hide the stage's own lights.
    The prim above them has the first target's centre as its origin, and the camera's axes, in all frames."""
    for prim in (own := find_lights(reader.stage)):
        if prim.IsInstanceProxy():
            found = "is a light of an instance, so no layer can hide it"
            raise InputError(found, where=prim.GetPath(), do="make its model not instanceable")
    hidden = (SampledValue(attribute=attribute_of(prim.GetAttribute("visibility")), value="invisible") for prim in own)
    above = reader.stage.GetDefaultPrim() or reader.stage.GetPseudoRoot()
    name = UniqueNames(taken=above.GetAllChildrenNames()).give(LIGHTS)
    home = Sdf.PrimSpec(Sdf.CreatePrimInLayer(layer, above.GetPath()), name, Sdf.SpecifierDef, "Xform")
    home.variantSetNameList.prependedItems.append(SET)
    home.variantSelections[SET] = OWN
    around = [_axes(reader, frame, base.metres) for frame in reader.frames]
    write_values(layer, SampledValues(attributes=(*hidden, *_values(home.path, base.times, around))))
    lights = dict.fromkeys(each.path for p in pictures for each in p.scene.lights if any(emission_of(each)))
    for path, name in zip(lights, unique_identifiers([path.rpartition("/")[2] for path in lights]), strict=True):
        _author_light(home, name, path, base, pictures)


def _axes(reader: StageReader, frame: FrameId, metres: float) -> Attributes:
    """Return the values that place the camera's axes in the target's centre, whatever is above them."""
    T_world_cam = reader.T_world_cam(frame)
    return {
        TRANSLATE: vec3d(_rounded(T_world_cam.points(_centre(reader.scene(frame))) / metres)),
        ORIENT: quatd(_rounded(T_world_cam.quaternion)),
        ORDER: ["!resetXformStack!", TRANSLATE[0], ORIENT[0]],
    }


def _author_light(home: Sdf.PrimSpec, name: str, path: str, base: BaseStage, pictures: Sequence[FittedPicture]) -> None:
    """Author the light at `path` in the pictures' scenes as the prim of that name: its place and size, and in each
    variant its strength."""
    lights = [next((light for light in each.scene.lights if light.path == path), None) for each in pictures]
    times = [base.times[each.frame.index] for each in pictures]
    pairs = zip(lights, pictures, strict=True)
    placed = [_placed(light, each.scene, base.metres) if light else {} for light, each in pairs]
    distant = any(isinstance(light, DistantLight) for light in lights)
    prim = Sdf.PrimSpec(home, name, Sdf.SpecifierDef, next(type(light).__name__ for light in lights if light))
    prim.customData = {"spin": {"intensityUnit": schema.INTENSITY_UNITS[0 if distant else 1]}}
    write_values(home.layer, SampledValues(attributes=tuple(_values(prim.path, times, placed))))
    strengths = [_strength(light) for light in lights]
    names = unique_identifiers([OWN, *(each.frame.name for each in pictures)])
    for variant, values in zip(names, [strengths, *([each] for each in strengths)], strict=True):
        moves = {str(home.path): f"{home.path}{{{SET}={variant}}}"}
        write_values(home.layer, SampledValues(attributes=tuple(_values(prim.path, times, values))), moves)


def _placed(light: Light, scene: Scene, metres: float) -> Attributes:
    """Return the values that decide the light's place around the target and its size, in stage units of `metres`, and
    the meaning of its intensity. Raises UnsupportedError."""
    beam = [getattr(light, name, None) for name in ("shaping", "image", "lights", "shadowed_by")]
    if not isinstance(light, LIGHT_TYPES) or not light.shadows or any(each is not None for each in beam):
        do = f"fit plain lights of the types {', '.join(each.__name__ for each in LIGHT_TYPES)}"
        raise UnsupportedError("cannot be written as a fitted light", where=light.path, do=do)
    if isinstance(light, DistantLight):
        turned = {ORIENT: quatd(rotation_of_z(-np.array(light.direction_cam), DIGITS)), ORDER: [ORIENT[0]]}
        return {**turned, ("inputs:angle", "float"): math.degrees(light.angle), ("inputs:normalize", "bool"): True}
    return {
        TRANSLATE: vec3d(_rounded((light.T_cam_light.translation - _centre(scene)) / metres)),
        ORIENT: quatd(_rounded(light.T_cam_light.quaternion)),
        ORDER: [TRANSLATE[0], ORIENT[0]],
        **{(f"inputs:{name}", "float"): getattr(light, name) / metres for name in light.lengths},
        ("inputs:normalize", "bool"): False,
    }


def _strength(light: Light | None) -> Attributes:
    """Return the intensity, 0 for no light, and the colour of a light that shines."""
    emission = emission_of(light) if light else (0.0, 0.0, 0.0)
    most = max(emission)
    colour = {("inputs:color", "color3f"): Gf.Vec3f(*(value / most for value in emission))} if most else {}
    return {("inputs:intensity", "float"): most, **colour}


def _centre(scene: Scene) -> Float:
    """Return the centre (3,) of the first target, camera axes, metres."""
    return scene.bodies[0].T_cam_body.points(scene.bodies[0].target.mesh.centre)


def _rounded(values: Float) -> Float:
    """Round values of a transform, so that those that stay the same are equal; no negative zeros."""
    rounded: Float = np.round(values, DIGITS) + 0.0
    return rounded


def _values(path: Sdf.Path, times: Sequence[float], each: Sequence[Attributes]) -> Iterator[SampledValue]:
    """Yield the attributes of the prim at `path`, from `each` of its values at these times; one value if all are
    equal."""
    for name, kind in dict.fromkeys(attribute for values in each for attribute in values):
        samples = tuple((time, v[name, kind]) for time, v in zip(times, each, strict=False) if (name, kind) in v)
        attribute = ChangedAttribute(prim=str(path), name=name, type=kind, uniform=(name, kind) == ORDER)
        if all(value == samples[0][1] for _, value in samples):
            yield SampledValue(attribute=attribute, value=samples[0][1])
        else:
            yield SampledValue(attribute=attribute, samples=samples)
