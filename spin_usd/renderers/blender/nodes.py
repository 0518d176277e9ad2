"""Shader nodes written as formulas: constants are computed here, only varying values become nodes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from spin_usd.basics.arrays import Float
from spin_usd.errors import RenderError

Value = Any
"""A constant, float or tuple of floats, or the output socket of a node."""

FOLDED: Mapping[str, Callable[..., float]] = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "MAXIMUM": max,
    "MINIMUM": min,
    "SQRT": lambda a: a**0.5,
    "LESS_THAN": lambda a, b: float(a < b),
    "GREATER_THAN": lambda a, b: float(a > b),
}
"""Results of Blender's Math node for constants. Division by zero is zero, as in Blender."""

SINGLE_PRECISION = 1e-6  # relative rounding of a float32 property, with room for its unit conversion
FLOAT32 = 2.0**-23  # relative rounding of a matrix that Blender stores


class Nodes:
    """The nodes of one material. `values` contains existing nodes by their names, so each is made once."""

    def __init__(self, name: str) -> None:
        self.material = bpy.data.materials.new(name)
        self._tree = self.material.node_tree
        self._tree.nodes.clear()
        self.values: dict[Any, Any] = {}

    def add(self, kind: str, inputs: Sequence[Value] | Mapping[str, Value] = (), **settings: Any) -> Any:
        """Return a new node of Blender's type `kind`, its inputs fed by place or by name."""
        node = self._tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for key, value in inputs.items() if isinstance(inputs, Mapping) else enumerate(inputs):
            self.feed(node.inputs[key], value)
        return node

    def feed(self, socket: Any, value: Value) -> None:
        """Give an input its constant or link it."""
        if not varies(value):
            is_color = socket.type == "RGBA"
            socket.default_value = (*value, 1.0) if is_color and len(value) == 3 else value
        else:
            self._tree.links.new(value, socket)

    def surface(self, shader: Any) -> Any:
        """Return the material, finished with `shader` as its surface."""
        self.feed(self.add("ShaderNodeOutputMaterial").inputs["Surface"], shader)
        return self.material

    def math(self, operation: str, *values: Value) -> Value:
        """Return the result of `operation`, one of FOLDED: a number where all values are numbers, else a node's
        output."""
        if not any(varies(value) for value in values):
            return FOLDED[operation](*values)
        return self.add("ShaderNodeMath", values, operation=operation).outputs[0]

    def clamped(self, value: Value, low: float, high: float) -> Value:
        return self.math("MINIMUM", self.math("MAXIMUM", value, low), high)

    def vector(self, operation: str, *values: Value) -> Any:
        """Return a Vector Math node's vector; floats count for each component."""
        spread = [(value,) * 3 if isinstance(value, (int, float)) else value for value in values]
        return self.add("ShaderNodeVectorMath", spread, operation=operation).outputs["Vector"]

    def mixed(self, factor: Value, first: Any, second: Any) -> Any:
        """Return the shader `first` at factor 0, `second` at 1."""
        return self.add("ShaderNodeMixShader", (factor, first, second)).outputs[0]

    def between(self, factor: Value, first: Value, second: Value) -> Any:
        """Return the number `first` at factor 0, `second` at 1."""
        node = self.add("ShaderNodeMix", {"Factor": factor, "A": first, "B": second})
        return node.outputs["Result"]

    def largest(self, color: Value) -> Value:
        """Return the largest component of a colour."""
        if not varies(color):
            return max(color)
        r, g, b = self.add("ShaderNodeSeparateColor", [color], mode="RGB").outputs
        return self.math("MAXIMUM", self.math("MAXIMUM", r, g), b)

    def blend(self, factor: Value, first: Value, second: Value) -> Any:
        """Return the colour `first` at factor 0, `second` at 1."""
        difference = self.vector("SUBTRACT", second, first)
        return self.vector("MULTIPLY_ADD", difference, factor, first)


def varies(value: Value) -> bool:
    """Return whether a value is a node's output, not a constant."""
    return isinstance(value, bpy.types.NodeSocket)


def assign(owner: Any, values: Mapping[str, Any]) -> None:
    """Set properties and read them back; RenderError names the first that Blender did not take."""
    for name, value in values.items():
        setattr(owner, name, value)
        got = getattr(owner, name)
        if not _same(got, value):
            raise RenderError(f"Blender set {type(owner).__name__}.{name} to {got!r} where {value!r} was wanted")


def assign_matrix(owner: Any, matrix: Float) -> None:
    """Place an object in its parent's axes by `matrix` (4, 4), metres; RenderError where Blender changes it.

    The matrix goes through the parent's inverse, which keeps each entry to float32's rounding; through a quaternion it
    was up to 17 times less exact.
    """
    owner.matrix_parent_inverse = Matrix(matrix)
    if not np.allclose(np.array(owner.matrix_parent_inverse), matrix, rtol=FLOAT32, atol=FLOAT32):
        raise RenderError(f"Blender changed the place of the object {owner.name!r}")


def _same(got: Any, want: Any) -> bool:
    if isinstance(want, (str, bool, int)):
        return bool(got == want)
    return bool(np.allclose(np.asarray(got), np.asarray(want), rtol=SINGLE_PRECISION, atol=1e-30))
