"""The hash of a composed stage's content, wherever it lies, and the files that it uses."""

import re
from pathlib import Path

from pxr import Ar, Sdf, Usd, UsdUtils

from spin_usd.basics.arrays import digest
from spin_usd.files.sha256 import sha256_of
from spin_usd.scene.scene import NOMINAL
from spin_usd.stage.composition.files import udim_files

AUGMENTATION = "augmentation"
PROTOTYPE = re.compile(r"\bFlattened_Prototype_\d+\b")


def selected_variant(stage: Usd.Stage) -> str:
    """Return the selection of the default prim's augmentation; "nominal" if there is none."""
    prim = stage.GetDefaultPrim()
    return (prim.GetVariantSet(AUGMENTATION).GetVariantSelection() if prim else "") or NOMINAL


def stage_hash(stage: Usd.Stage) -> str:
    """Compute the sha256 (hex) of the composed content, its assets' bytes and the selected variant.

    It does not depend on where the stage lies or how it is split into layers, and ignores variants not selected.
    """
    return _hash(stage, stage.Flatten(addSourceFileComment=False))


def hash_and_files(stage: Usd.Stage, root: str | Path) -> tuple[str, dict[str, str]]:
    """Return the results of `stage_hash` and `used_files`; the stage, which may have a million poses, is flattened
    once."""
    flat = stage.Flatten(addSourceFileComment=False)
    files = _files(stage, flat, root)  # before the hash takes the paths away
    return _hash(stage, flat), files


def _hash(stage: Usd.Stage, flat: Sdf.Layer) -> str:
    """Compute the hash of a stage that is flattened to `flat`, which is changed."""
    UsdUtils.ModifyAssetPaths(flat, lambda path: f"sha256:{asset_sha256(path)}" if path else path)
    return digest([selected_variant(stage), flattened_text(flat)])


def used_files(stage: Usd.Stage, root: str | Path) -> dict[str, str]:
    """Map the path, relative to `root`, of every layer and asset that this composition uses to its sha256 (hex), in
    order."""
    return _files(stage, stage.Flatten(addSourceFileComment=False), root)


def _files(stage: Usd.Stage, flat: Sdf.Layer, root: str | Path) -> dict[str, str]:
    """Return the files of a stage that is flattened to `flat`."""
    folder = Path(root).resolve()
    paths = [layer.realPath for layer in stage.GetUsedLayers() if not layer.anonymous]

    def note(path: str) -> str:
        paths.append(path)
        return path

    UsdUtils.ModifyAssetPaths(flat, note)
    files = sorted({file for path in paths if path for file in _resolved(path)})
    return {_relative(file, folder): sha256_of(file) for file in files}


def _resolved(path: str) -> list[Path]:
    """List the files of an absolute asset path: a package for a path into it, several for <UDIM>, or none."""
    outer = Path(Ar.SplitPackageRelativePathOuter(path)[0])
    return [file for file in udim_files(outer) if file.is_file()]


def asset_sha256(path: str) -> str:
    """Digest the files of a resolved asset path, in any folder; "missing NAME" if there are none."""
    inner = Ar.SplitPackageRelativePathOuter(path)[1]
    files = _resolved(path)
    return digest([[sha256_of(file) for file in files], inner]) if files else f"missing {Path(path).name}"


def _relative(file: Path, folder: Path) -> str:
    real = file.resolve()
    return real.relative_to(folder).as_posix() if real.is_relative_to(folder) else real.as_posix()


def flattened_text(flat: Sdf.Layer) -> str:
    """Return the text of the layer `flat`, the same in every process, with its prototypes removed from `flat`.

    USD numbers and writes the prototypes of instances in the order in which its threads find them, which varies. Here
    they are numbered and ordered by their first reference, from the stage's own prims down.
    """
    prototypes = {prim.name: prim.GetAsText() for prim in flat.rootPrims if PROTOTYPE.fullmatch(prim.name)}
    if len(prototypes) < 2:
        return str(flat.ExportToString())
    for name in prototypes:
        del flat.rootPrims[name]
    texts = [flat.ExportToString()]
    numbers: dict[str, str] = {}
    for text in texts:  # the list grows by every prototype that is found
        for name in (name for name in PROTOTYPE.findall(text) if name in prototypes and name not in numbers):
            numbers[name] = f"Flattened_Prototype_{len(numbers) + 1}"
            texts.append(prototypes[name])
    texts += [text for name, text in sorted(prototypes.items()) if name not in numbers]  # a stage's own of that name
    return "\n".join(PROTOTYPE.sub(lambda found: numbers.get(found[0], found[0]), text) for text in texts)
