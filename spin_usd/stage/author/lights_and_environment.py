"""Rigs: the lights of a stage, and what lies behind its target, as layers that travel with spin_usd or are given.

A rig is a layer whose default prim is Lights or Environment; `stages/environments` holds both kinds.
"""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf, Tf, Usd

from spin_usd.errors import InputError
from spin_usd.resources import bundled
from spin_usd.stage.usd.layer_file import author_metadata, open_layer, reason

LIGHTS, ENVIRONMENT = "Lights", "Environment"
KINDS = {LIGHTS: "lights", ENVIRONMENT: "environments"}
USUAL: Mapping[str, str] = {LIGHTS: "sun", ENVIRONMENT: "deep_space"}
"""The rig of each kind that a stage has unless another is chosen."""


def rig_names(kind: str) -> tuple[str, ...]:
    """The rigs of that kind, LIGHTS or ENVIRONMENT, that travel with spin_usd."""
    return tuple(bundled(KINDS[kind]))


def rig_by_name(name: str, kind: str) -> Path:
    """The layer of a rig that travels with spin_usd. Raises InputError that lists those there are."""
    names = rig_names(kind)
    if name not in names:
        found = f"there are no {kind.lower()} named {name!r}" if kind == LIGHTS else f"there is no environment {name!r}"
        raise InputError(found, do=f"name one of {', '.join(names)}, or a layer")
    return bundled(KINDS[kind])[name]


def open_rig(path: str | Path, kind: str) -> Sdf.Layer:
    """All that the rig at `path` composes, as one anonymous layer, asset paths absolute.

    Raises InputError that names the file where it is no rig of that kind.
    """
    layer = open_layer(Path(path))
    flat = composed(layer, path)
    if layer.defaultPrim != kind or not flat.GetPrimAtPath(f"/{kind}"):
        raise InputError(f"is no rig of this kind: its default prim is not {kind}", where=path)
    return extracted(flat, Sdf.Path(f"/{kind}"), layer.documentation)


def composed(layer: Sdf.Layer, path: str | Path) -> Sdf.Layer:
    """The layer at `path` with all that it refers to flattened in. Raises InputError where it does not compose."""
    try:
        stage = Usd.Stage.Open(layer)
    except Tf.ErrorException as error:
        raise InputError(f"does not compose: {reason(error)}", where=path) from None
    if errors := stage.GetCompositionErrors():
        raise InputError(f"does not compose: {errors[0]}", where=path)
    return stage.Flatten(addSourceFileComment=False)


def extracted(flat: Sdf.Layer, prim: Sdf.Path, documentation: str) -> Sdf.Layer:
    """`prim` and what is below it as a layer of its own."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=prim.name, documentation=documentation)
    Sdf.CopySpec(flat, prim, layer, Sdf.Path.absoluteRootPath.AppendChild(prim.name))
    return layer
