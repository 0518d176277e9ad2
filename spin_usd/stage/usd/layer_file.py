"""Layers as files: written with the metadata that every layer repeats."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeAlias

from pxr import Sdf, Tf, UsdGeom

from spin_usd.errors import OutputError, StageError
from spin_usd.stage.usd.parser_faults import parser_faults, reason

Layer: TypeAlias = Sdf.Layer
"""A layer's type, for callers outside this package, which do not import pxr."""

TIME_CODES_PER_SECOND = 24.0
UP_AXIS = UsdGeom.Tokens.z
METERS_PER_UNIT = 1.0


def layer_at(file: str | Path) -> Sdf.Layer:
    """Return the layer in a file that may be opened. Raises StageError for one that USD cannot read, which USD does not
    always report as an error."""
    with parser_faults(file):
        layer = Sdf.Layer.FindOrOpen(str(file))
    if layer is None:
        raise StageError("USD cannot read it", where=file, do="fix the layer, or write it again")
    return layer


def reload_layers() -> None:
    """Read the layers that this process holds again where their files have changed since. Those whose files are gone or
    damaged stay as they were."""
    for layer in Sdf.Layer.GetLoadedLayers():
        # a layer expires when the reload of another one ends the last stage that holds it, and at any moment when the
        # collector ends it: then a method of the layer raises ArgumentError, a TypeError
        with suppress(Tf.ErrorException, TypeError):
            if not layer.expired and not layer.anonymous and not layer.dirty:
                layer.Reload()


def author_metadata(layer: Sdf.Layer, *, default_prim: str, documentation: str = "", frames: int = 1) -> None:
    """Author the metadata that USD reads from the root layer only; every layer may be root: axis, units, time, default
    prim."""
    layer.defaultPrim = default_prim
    layer.documentation = documentation
    root = layer.pseudoRoot
    root.SetInfo("upAxis", UP_AXIS)
    root.SetInfo("metersPerUnit", METERS_PER_UNIT)
    layer.timeCodesPerSecond = layer.framesPerSecond = TIME_CODES_PER_SECOND
    layer.startTimeCode, layer.endTimeCode = 0.0, float(frames - 1)


def export(layer: Sdf.Layer, path: Path) -> None:
    """Write `layer` to `path`, folders included. Raises OutputError."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if not layer.Export(str(path)):
            raise OutputError("cannot be written", where=path)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn an error of the system or of USD about a failed write into OutputError."""
    try:
        yield
    except Tf.ErrorException as error:
        raise OutputError(f"cannot be written ({reason(error)})", where=path) from None
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"cannot be written ({error.strerror or error})", where=path) from None
