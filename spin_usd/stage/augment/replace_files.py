"""The files of augmentations: they are written to a temporary folder, tried there, and then put into place at once."""

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pxr import Sdf

from spin_usd.errors import InputError, OutputError
from spin_usd.stage.usd.layer_file import export, writing

FOLDER = "layers"
SET = "augmentations"
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
"""Metadata that USD reads from the root layer only."""


def set_name(out: Path | None) -> str:
    """Name the augmentations' folder in FOLDER and the layer beside it; `out` is their own root layer, if any."""
    return SET if out is None else f"{out.stem}_{SET}"


@contextmanager
def written_in(work: Path) -> Iterator[None]:
    """Name the final path of a file in an error, where it could not be written in the temporary folder `work`."""
    try:
        yield
    except OutputError as error:
        where = str(error.where).replace(f"/{work.name}/", f"/{FOLDER}/")
        raise OutputError(error.found, where=where, do=error.do) from None


def replace(work: Path, layers: Path, name: str) -> None:
    """Move the written files into place, or leave the old ones."""
    own, old = layers / name, work / "old"
    with writing(own):
        layers.mkdir(exist_ok=True)
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


def refuse_other_root(path: Path, final: Path, root: Sdf.Layer, layer: str, temporary: Path) -> None:
    """Raise InputError where a new root layer would replace a file that is not the same; `temporary` is written."""
    if final == path or not final.exists():
        return
    export(root_over(path, final, root, layer), temporary)
    if temporary.read_bytes() != final.read_bytes():
        found = "exists already, and is not the root layer that would be written"
        raise InputError(found, where=final, do="choose another --out, or move it elsewhere")


def write_root(path: Path, final: Path, root: Sdf.Layer, layer: str, temporary: Path) -> None:
    """Add the layer to the root's sublayers, where it is not one yet; comments stay where the text can be edited. The
    root is written as `temporary` first."""
    if final == path and layer in root.subLayerPaths:
        return
    made = root_over(path, final, root, layer)
    with writing(final):
        text = _with_sublayer(path, made, layer) if final == path else None
        if text is None:
            export(made, temporary)
        else:
            temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, final)


def root_over(path: Path, final: Path, root: Sdf.Layer, layer: str) -> Sdf.Layer:
    """Make the stage's root layer with `layer` as its strongest sublayer; for another file a new one over the
    stage's."""
    made = Sdf.Layer.CreateAnonymous(path.suffix)
    if final == path:
        made.TransferContent(root)
        own = f"./{FOLDER}/{SET}.usda"
        made.subLayerPaths = [layer, *(sublayer for sublayer in root.subLayerPaths if sublayer != own)]
    else:
        repeat(root, made, REPEATED)
        made.documentation = f"{path.name} with augmentations."
        made.subLayerPaths = [layer, f"./{path.name}"]
    return made


def _with_sublayer(path: Path, made: Sdf.Layer, layer: str) -> str | None:
    """Return the root's text with `layer` as its first sublayer, if it parses to the same as `made`, else None."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return None
    edited = text.replace("subLayers = [", f"subLayers = [\n        @{layer}@,", 1)
    parsed = Sdf.Layer.CreateAnonymous(".usda")
    same = parsed.ImportFromString(edited) and parsed.ExportToString() == made.ExportToString()
    return edited if same and edited != text else None


def repeat(root: Sdf.Layer, layer: Sdf.Layer, names: Sequence[str]) -> None:
    """Copy the root's metadata of these names into `layer`."""
    for name in names:
        if root.pseudoRoot.HasInfo(name):
            layer.pseudoRoot.SetInfo(name, root.pseudoRoot.GetInfo(name))


def read_again(file: Path) -> None:
    """Reload the file, where a stage that is open in this process uses it."""
    if layer := Sdf.Layer.Find(str(file.resolve())):
        layer.Reload(force=True)
