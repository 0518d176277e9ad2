"""Shader networks: the value of a node's input, through material interfaces and node graphs."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdShade

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.usd.image_tiles import resolved_tiles
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.values import read, read_any

PREVIEW_SURFACE = "UsdPreviewSurface"
LINEAR = ("", "lin_rec709_scene", "lin_rec709", "raw", "data", "identity")


@dataclass(frozen=True, kw_only=True)
class Output:
    """An output of another node, to which an input is connected."""

    shader: UsdShade.Shader
    name: str
    where: str
    """Path of that input."""

    @property
    def node(self) -> str:
        """The identifier of the other node."""
        return node_id(self.shader)


def node_id(shader: UsdShade.Shader) -> str:
    """Return the node's identifier. Raises UnsupportedError for a node that is given by a file or by code."""
    identifier = read(shader.GetIdAttr()) if shader.GetImplementationSource() == UsdShade.Tokens.id else None
    if not identifier:
        raise UnsupportedError("has no info:id", where=shader.GetPath(), do="use the nodes of UsdPreviewSurface")
    return str(identifier)


def read_input(shader: UsdShade.Shader, name: str, time: Usd.TimeCode) -> Any:
    """Read the input `name`: a value, an Output, or None where nothing is authored.

    Raises StageError for a connection in a circle or to several values, UnsupportedError for a value in a colour space
    other than linear Rec. 709.
    """
    shader_input = shader.GetInput(name)
    if not shader_input:
        return None
    where = input_path(shader, name)
    sources = shader_input.GetValueProducingAttributes()
    if not sources:
        return None
    if len(sources) > 1:
        raise StageError(f"is connected to {len(sources)} sources", where=where, do="connect one")
    source = sources[0]
    if UsdShade.Utils.GetType(source.GetName()) == UsdShade.AttributeType.Output:
        return Output(shader=UsdShade.Shader(source.GetPrim()), name=source.GetName().split(":", 1)[1], where=where)
    refuse_other_colours(source, where)
    return resolved_tiles(source, read_any(source, time))


def refuse_other_colours(attribute: Usd.Attribute, where: object) -> None:
    """Raise UnsupportedError for a value in a colour space other than linear Rec. 709: its own, or, of a colour, that
    which ColorSpaceAPI gives its prim or one above."""
    space = str(attribute.GetColorSpace()) if attribute.HasColorSpace() else ""
    if not space and attribute.GetRoleName() == Sdf.ValueRoleNames.Color:
        space = str(Usd.ColorSpaceAPI.ComputeColorSpaceName(attribute, None))
    if space not in LINEAR:
        raise UnsupportedError(f"is given in colour space '{space}'", where=where, do="author linear Rec. 709 values")


def note_lost_connections(shader: UsdShade.Shader, notes: Notes) -> None:
    """Note the inputs of the node that are connected to a source without value; a stronger layer may have removed
    it."""
    for each in shader.GetInputs():
        own = each.GetAttr()
        if own.GetConnections() and all(source == own for source in each.GetValueProducingAttributes()):
            message = "is connected to a source without value: its own value is rendered, or the node's fallback"
            notes.add("connection-lost", own.GetPath(), message)


def read_constant(shader: UsdShade.Shader, name: str, time: Usd.TimeCode) -> Any:
    """Read an input as `read_input` does, but one that must not vary over the surface."""
    value = read_input(shader, name, time)
    if isinstance(value, Output):
        found = f"is connected to {value.shader.GetPath()}"
        raise UnsupportedError(found, where=value.where, do="author a constant")
    return value


def read_numbers(shader: UsdShade.Shader, name: str, time: Usd.TimeCode, default: tuple[float, ...]) -> Float:
    """Read a constant of as many numbers as `default`, which is the value where nothing is authored."""
    return numbers(read_constant(shader, name, time), default, input_path(shader, name))


def numbers(value: Any, default: tuple[float, ...], where: str) -> Float:
    """Convert `value` to as many numbers as `default` has, which replaces None."""
    if value is None:
        return np.array(default, np.float64)
    array = np.array(value)
    if array.dtype.kind not in "fiu" or array.size != len(default):
        found = f"is {value!r}, expected {len(default)} number{'s' * (len(default) > 1)}"
        raise StageError(found, where=where, do="author a value of the type that the node's definition gives")
    return array.reshape(-1).astype(np.float64)


def read_token(shader: UsdShade.Shader, name: str, time: Usd.TimeCode, allowed: tuple[str, ...], default: str) -> str:
    """Read a constant that is one of `allowed`."""
    value = read_constant(shader, name, time)
    if value is None:
        return default
    if str(value) not in allowed:
        where = input_path(shader, name)
        raise UnsupportedError(f"is '{value}'", where=where, do=f"use one of {', '.join(allowed)}")
    return str(value)


def input_path(shader: UsdShade.Shader, name: str) -> str:
    """Return the path of an input, for messages."""
    return f"{shader.GetPath()}.inputs:{name}"
