"""Writes augmentations: a layer for each, and the variant set `augmentation` that refers to them, over a stage.

All is written beside its place first, and read once; then it takes the place of what was there.
"""

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Usd

from spin_usd import __version__
from spin_usd.errors import InputError, OutputError, SpinError
from spin_usd.stage import schema
from spin_usd.stage.backgrounds import Background, write_background
from spin_usd.stage.cameras import find_camera, read_camera
from spin_usd.stage.captures import read_frames
from spin_usd.stage.compose import open_stage
from spin_usd.stage.content import AUGMENTATION
from spin_usd.stage.images import Images
from spin_usd.stage.layer import author_metadata, export, open_layer, writing
from spin_usd.stage.lights import LightReader
from spin_usd.stage.optics import read_optics
from spin_usd.stage.samples import Opinions, write_opinions
from spin_usd.stage.sensor import read_sensor
from spin_usd.stage.thin_lens import read_thin_lens

FOLDER = "layers"
SET = "augmentations"
MOST_IN_TEXT = 4096  # pictures whose samples a person would still read
REPEATED = (
    "upAxis",
    "metersPerUnit",
    "timeCodesPerSecond",
    "framesPerSecond",
    "startTimeCode",
    "endTimeCode",
    "renderSettingsPrimPath",
    "defaultPrim",
)
"""What USD reads from the root layer only."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Augmentation:
    """selections: variant set of the default prim -> variant."""

    name: str
    selections: Mapping[str, str]
    what: Opinions
    background: Background | None = None


@dataclass(frozen=True, kw_only=True)
class Source:
    """The specification that the augmentations were drawn from."""

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
    """The stage at `path` without augmentation, with these variants of its default prim's sets selected.

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
    if variant not in (known := prim.GetVariantSet(name).GetVariantNames()):
        found = f"the variant set {name!r} has no {variant!r}"
        raise InputError(found, where=f"select.{name}", do=f"select one of {', '.join(known)}")


def write_augmentations(path: Path, out: Path | None, augmentations: Sequence[Augmentation], source: Source) -> Path:
    """Write them over the stage at `path`, in place, or as the new root layer `out` beside it; returns the root layer.

    Written in place again they replace those that were there. Raises InputError for what a picture could not be taken
    with, OutputError where it cannot be written; then all is as it was.
    """
    root, frames = open_layer(path), len(read_frames(open_stage(path), ""))
    final = path if out is None else out
    if final.resolve().parent != path.resolve().parent:
        raise InputError("is not in the stage's folder", where=out, do=f"write it to {path.parent}")
    name = SET if out is None else f"{out.stem}_{SET}"
    with _work_folder(path.parent / FOLDER, name) as work:
        for augmentation in augmentations:
            _write_one(work / name, augmentation, root, frames, source)
        export(_variants(augmentations, name, root, frames, source), work / f"{name}.usda")
        with _trial(path, final, root, f"./{FOLDER}/{work.name}/{name}.usda") as trial:
            for augmentation in augmentations:
                _read_once(trial, augmentation.name)
        _replace(work, path.parent / FOLDER, name)
        _write_root(path, final, root, f"./{FOLDER}/{name}.usda")
    for file in (final, path.parent / FOLDER / f"{name}.usda", *(path.parent / FOLDER / name).iterdir()):
        _read_again(file)
    return final


def _read_again(file: Path) -> None:
    """Let stages that are open in this process see what the file holds now."""
    if layer := Sdf.Layer.Find(str(file.resolve())):
        layer.Reload(force=True)


def _write_one(folder: Path, augmentation: Augmentation, root: Sdf.Layer, frames: int, source: Source) -> None:
    """One augmentation's own values."""
    layer = Sdf.Layer.CreateAnonymous(_suffix(augmentation, frames))
    selected = ", ".join(f"{name} {variant}" for name, variant in augmentation.selections.items())
    documentation = f"What the augmentation {augmentation.name} draws, over {selected or 'the stage as it is'}."
    _head(layer, root, frames, documentation, source)
    write_opinions(layer, augmentation.what)
    if augmentation.background:
        write_background(layer, augmentation.background, folder / "backgrounds")
    export(layer, folder / _file(augmentation, frames))


def _suffix(augmentation: Augmentation, frames: int) -> str:
    many = frames > MOST_IN_TEXT and any(opinion.samples for opinion in augmentation.what.attributes)
    return ".usdc" if many else ".usda"


def _file(augmentation: Augmentation, frames: int) -> str:
    return f"{augmentation.name}{_suffix(augmentation, frames)}"


def _variants(
    augmentations: Sequence[Augmentation], folder: str, root: Sdf.Layer, frames: int, source: Source
) -> Sdf.Layer:
    """The variant set: each variant selects among the other sets and refers to its own layer."""
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
    """What every layer repeats, as the stage's root says it."""
    author_metadata(layer, default_prim=root.defaultPrim, documentation=documentation, frames=frames)
    _repeat(root, layer, [name for name in REPEATED if name != "renderSettingsPrimPath"])
    source.author(layer)
    Sdf.CreatePrimInLayer(layer, Sdf.Path.absoluteRootPath.AppendChild(root.defaultPrim))


def _repeat(root: Sdf.Layer, layer: Sdf.Layer, names: Sequence[str]) -> None:
    for name in names:
        if root.pseudoRoot.HasInfo(name):
            layer.pseudoRoot.SetInfo(name, root.pseudoRoot.GetInfo(name))


@contextmanager
def _work_folder(layers: Path, name: str) -> Iterator[Path]:
    """A folder to write in, gone in the end."""
    work = layers / f".{name}.{os.getpid()}"
    with writing(work):
        _sweep(layers.glob(f".{name}.*"))
        (work / name).mkdir(parents=True)
    try:
        yield work
    except OutputError as error:
        where = str(error.where).replace(f"/{work.name}/", "/")
        raise OutputError(error.found, where=where, do=error.do) from None
    finally:
        shutil.rmtree(work, ignore_errors=True)


@contextmanager
def _trial(path: Path, final: Path, root: Sdf.Layer, layer: str) -> Iterator[Path]:
    """The root layer over what lies in the work folder, gone in the end."""
    trial = path.parent / f".{final.stem}.{os.getpid()}{path.suffix}"
    _sweep(path.parent.glob(f".{final.stem}.*{path.suffix}"))
    try:
        export(_root_over(path, final, root, layer), trial)
        yield trial
    finally:
        trial.unlink(missing_ok=True)


def _sweep(left: Iterable[Path]) -> None:
    """Remove what runs that were killed have left: files and folders named by a process that is no more."""
    for path in left:
        number = path.name.split(".")[2]
        if number.isdecimal() and not _runs(int(number)):
            shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)  # asks only
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # another's
        return True
    return True


def _root_over(path: Path, final: Path, root: Sdf.Layer, layer: str) -> Sdf.Layer:
    """The stage's root layer with `layer` as its strongest sublayer; for another file a new one over the stage's."""
    made = Sdf.Layer.CreateAnonymous(path.suffix)
    if final == path:
        made.TransferContent(root)
        own = f"./{FOLDER}/{SET}.usda"
        made.subLayerPaths = [layer, *(sublayer for sublayer in root.subLayerPaths if sublayer != own)]
    else:
        _repeat(root, made, REPEATED)
        made.documentation = f"{path.name} with augmentations."
        made.subLayerPaths = [layer, f"./{path.name}"]
    return made


def _read_once(trial: Path, variant: str) -> None:
    """Raise InputError where camera or lights of the first picture could not be used."""
    try:
        stage = open_stage(trial, variant=variant)
        frame = read_frames(stage, variant)[0]
        camera, time = find_camera(stage), Usd.TimeCode(frame.time_code)
        lens = read_camera(camera, time)
        read_sensor(camera, time)
        read_optics(camera, lens, time)
        read_thin_lens(camera, time, 1.0)
        LightReader(stage, Images())
    except SpinError as error:
        where = f"augmentation {variant}: {error.where}"
        raise InputError(error.found, where=where, do=error.do) from None


def _replace(work: Path, layers: Path, name: str) -> None:
    """Put what was written into its place, or leave what was there."""
    own, old = layers / name, work / "old"
    with writing(own):
        if own.exists():
            os.replace(own, old)
        try:
            os.replace(work / name, own)
            os.replace(work / f"{name}.usda", layers / f"{name}.usda")
        except OSError:
            if old.exists():
                shutil.rmtree(own, ignore_errors=True)
                os.replace(old, own)
            raise


def _write_root(path: Path, final: Path, root: Sdf.Layer, layer: str) -> None:
    """Let the root name the layer, where it does not yet: a comment in it stays where its text can be kept."""
    if final == path and layer in root.subLayerPaths:
        return
    made = _root_over(path, final, root, layer)
    temporary = final.with_name(f".{final.name}.{os.getpid()}")
    with writing(final):
        text = _with_sublayer(path, made, layer) if final == path else None
        if text is None:
            export(made, temporary.with_suffix(path.suffix))
            os.replace(temporary.with_suffix(path.suffix), final)
        else:
            temporary.write_text(text, encoding="utf-8")
            os.replace(temporary, final)


def _with_sublayer(path: Path, made: Sdf.Layer, layer: str) -> str | None:
    """The text of the root with `layer` put first into its sublayers, if that says the same as `made`."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return None
    edited = text.replace("subLayers = [", f"subLayers = [\n        @{layer}@,", 1)
    parsed = Sdf.Layer.CreateAnonymous(".usda")
    same = parsed.ImportFromString(edited) and parsed.ExportToString() == made.ExportToString()
    return edited if same and edited != text else None
