"""Augmentations written over a stage: a layer for each, and the variant set `augmentation` that refers to them.

All files are written to a temporary folder and read once; then they replace the files that were there.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Usd

from spin_usd import __version__
from spin_usd.errors import InputError, SpinError
from spin_usd.stage.augment.background import Background, write_background
from spin_usd.stage.augment.replace_files import (
    FOLDER,
    REPEATED,
    read_again,
    refuse_other_root,
    repeat,
    replace,
    root_over,
    set_name,
    write_root,
    written_in,
)
from spin_usd.stage.augment.sampled_values import SampledValues, write_values
from spin_usd.stage.composition.copy_stage import Copies
from spin_usd.stage.composition.images import Images
from spin_usd.stage.composition.open_layer import open_layer
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.composition.stage_hash import AUGMENTATION
from spin_usd.stage.read.camera import find_cameras, read_camera
from spin_usd.stage.read.frames import read_frames
from spin_usd.stage.read.lights import LightReader
from spin_usd.stage.read.optics import read_optics, read_thin_lens
from spin_usd.stage.read.sensor import read_sensor
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import author_metadata, export, writing

MAX_FRAMES_IN_TEXT = 4096  # with more time samples than this a layer is not written as text


@dataclass(frozen=True, kw_only=True, eq=False)
class Augmentation:
    """One augmentation: its sampled values."""

    name: str
    selections: Mapping[str, str]
    """Variant set of the default prim -> variant."""
    values: SampledValues
    background: Background | None = None


@dataclass(frozen=True, kw_only=True)
class Source:
    """The specification that the augmentations were sampled from."""

    name: str
    sha256: str
    seed: int

    def author(self, layer: Sdf.Layer) -> None:
        data = dict(layer.customLayerData)
        data[schema.PROVENANCE] = {
            "version": __version__,
            "spec": {"name": self.name, "sha256": self.sha256, "seed": str(self.seed)},
        }
        layer.customLayerData = data


def open_selected(path: Path, selections: Mapping[str, str]) -> Usd.Stage:
    """Open the stage at `path` without augmentation, with these variants of its default prim's sets selected.

    Raises InputError for a set or a variant that it does not have.
    """
    stage = open_stage(path)
    prim = stage.GetDefaultPrim()
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for name, variant in selections.items():
            _check_selection(prim, name, variant)
            prim.GetVariantSet(name).SetVariantSelection(variant)
    return stage


def _check_selection(prim: Usd.Prim, name: str, variant: str) -> None:
    sets = [each for each in prim.GetVariantSets().GetNames() if each != AUGMENTATION] if prim else []
    if name not in sets:
        do = f"select among {', '.join(sets)}" if sets else "author the stage with them, or select nothing"
        raise InputError(f"the stage has no variant set {name!r}", where=f"select.{name}", do=do)
    if variant not in (names := prim.GetVariantSet(name).GetVariantNames()):
        found = f"the variant set {name!r} has no {variant!r}"
        raise InputError(found, where=f"select.{name}", do=f"select one of {', '.join(names)}")


def write_augmentations(
    path: Path,
    out: Path | None,
    augmentations: Sequence[Augmentation],
    source: Source,
    *,
    work: Path,
    trial: Path,
    list_files: Callable[[Path], None],
) -> Path:
    """Write augmentations over the stage at `path`, in place, or as the new root layer `out` beside it. Returns the
    root layer's path.

    work: a folder beside it, and trial: a file there, both of which the caller removes. list_files gets the folder of
    augmentations when all in it and the layer beside it are written, and may add to it. Augmentations that were written
    in place before are replaced. Raises InputError where the first picture of a variant cannot be read, and for another
    file at `out`; OutputError for a failed write; then all files are as they were.
    """
    root, frames = open_layer(path), len(read_frames(open_stage(path), ""))
    final = path if out is None else out
    if final.resolve().parent != path.resolve().parent:
        raise InputError("is not in the stage's folder", where=out, do=f"write it to {path.parent}")
    name = set_name(out)
    layer = f"./{FOLDER}/{name}.usda"
    with written_in(work):
        refuse_other_root(path, final, root, layer, trial)
        photographs = Copies()
        for augmentation in augmentations:
            _write_one(work / name, augmentation, root, frames, source, photographs)
        export(_variants(augmentations, name, root, frames, source), work / f"{name}.usda")
        export(root_over(path, final, root, f"./{work.name}/{name}.usda"), trial)
        for augmentation in augmentations:
            _check_first_picture(trial, augmentation.name)
        with writing(work / name):
            list_files(work / name)
        replace(work, path.parent / FOLDER, name)
        write_root(path, final, root, layer, trial)
    for file in (final, path.parent / FOLDER / f"{name}.usda", *(path.parent / FOLDER / name).iterdir()):
        read_again(file)
    return final


def _write_one(
    folder: Path,
    augmentation: Augmentation,
    root: Sdf.Layer,
    frames: int,
    source: Source,
    photographs: Copies,
) -> None:
    """Write the layer of one augmentation's values. photographs: as write_background has `copies`."""
    layer = Sdf.Layer.CreateAnonymous(_suffix(augmentation, frames))
    selected = ", ".join(f"{name} {variant}" for name, variant in augmentation.selections.items())
    documentation = (
        f"The values that the augmentation {augmentation.name} samples, over {selected or 'the stage as it is'}."
    )
    _head(layer, root, frames, documentation, source)
    write_values(layer, augmentation.values)
    if augmentation.background:
        write_background(layer, augmentation.background, folder, photographs)
    export(layer, folder / _file(augmentation, frames))


def _suffix(augmentation: Augmentation, frames: int) -> str:
    changes = any(each.samples for each in augmentation.values.attributes)
    changes |= bool(augmentation.background and augmentation.background.times)
    return ".usdc" if changes and frames > MAX_FRAMES_IN_TEXT else ".usda"


def _file(augmentation: Augmentation, frames: int) -> str:
    return f"{augmentation.name}{_suffix(augmentation, frames)}"


def _variants(
    augmentations: Sequence[Augmentation], folder: str, root: Sdf.Layer, frames: int, source: Source
) -> Sdf.Layer:
    """Make the layer of the variant set: each variant selects among the other sets and refers to its own layer."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    _head(layer, root, frames, f"The augmentations of the specification {source.name}: one variant each.", source)
    prim = Sdf.CreatePrimInLayer(layer, Sdf.Path.absoluteRootPath.AppendChild(root.defaultPrim))
    prim.variantSetNameList.prependedItems.append(AUGMENTATION)
    variants = Sdf.VariantSetSpec(prim, AUGMENTATION)
    for augmentation in augmentations:
        variant = Sdf.VariantSpec(variants, augmentation.name).primSpec
        for name, selection in augmentation.selections.items():
            variant.variantSelections[name] = selection
        variant.referenceList.prependedItems.append(Sdf.Reference(f"./{folder}/{_file(augmentation, frames)}"))
    return layer


def _head(layer: Sdf.Layer, root: Sdf.Layer, frames: int, documentation: str, source: Source) -> None:
    """Author the metadata that every layer repeats from the stage's root layer."""
    author_metadata(layer, default_prim=root.defaultPrim, documentation=documentation, frames=frames)
    repeat(root, layer, [name for name in REPEATED if name != "renderSettingsPrimPath"])
    source.author(layer)
    Sdf.CreatePrimInLayer(layer, Sdf.Path.absoluteRootPath.AppendChild(root.defaultPrim))


def _check_first_picture(root: Path, variant: str) -> None:
    """Raise InputError where the camera or the lights of the first picture cannot be read."""
    try:
        stage = open_stage(root, variant=variant)
        frame = read_frames(stage, variant)[0]
        time = Usd.TimeCode(frame.time_code)
        for camera in find_cameras(stage).values():
            lens = read_camera(camera, time)
            read_sensor(camera, time)
            read_optics(camera, lens, time)
            read_thin_lens(camera, time, 1.0)
        LightReader(stage, Images())
    except SpinError as error:
        where = f"augmentation {variant}: {error.where}"
        raise InputError(error.found, where=where, do=error.do) from None
