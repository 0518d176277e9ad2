"""Layers opened from files, and stages composed of layers: the only way to either."""

from pathlib import Path

from pxr import Sdf, Usd

from spin_usd.errors import InputError
from spin_usd.stage.composition.excess import refuse_excess
from spin_usd.stage.composition.files import files_of
from spin_usd.stage.usd.layer_file import layer_at
from spin_usd.stage.usd.parser_faults import parser_faults


def open_layer(path: str | Path) -> Sdf.Layer:
    """Open the layer in the file at `path`, which must exist. Raises InputError without one, StageError if USD must not
    open it or a file that it names (see `files`); it may name bundled files."""
    if not Path(path).is_file():
        raise InputError("is not there, or is not a file", where=path)
    files = files_of(path, also_bundled=True)
    return layer_at(files.root)


def stage_on(root: Sdf.Layer, session: Sdf.Layer | None = None) -> Usd.Stage:
    """Compose `root`, a layer that was made here or opened by `open_layer`, under `session`. Raises StageError if it is
    too large to compose."""
    where = root.realPath or root.identifier
    with parser_faults(where):
        refuse_excess(root, session, where)
        return Usd.Stage.Open(root, session or Sdf.Layer.CreateAnonymous("session.usda"))


def default_prim_on(root: Sdf.Layer, session: Sdf.Layer) -> Usd.Stage:
    """Compose the default prim of `root` without anything below it."""
    above = root.GetDefaultPrimAsPath() or Sdf.Path.absoluteRootPath
    return Usd.Stage.OpenMasked(root, session, Usd.StagePopulationMask([above.AppendChild("nothing_below")]))
