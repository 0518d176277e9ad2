"""Conditions on pictures, written as Python expressions: `range < 8 and visible > 0.5`.

Names are those of `values_of`, for the picture and its first target; `tango.range` is a value of the target of that
name, `record.sun.obscured` of the record. Nothing is called, and nothing else is accessible.
"""

import ast
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import nan
from typing import Any

from spin_usd.errors import InputError
from spin_usd.reading.description import Description
from spin_usd.reading.measures import MEASURES, OF_PICTURE
from spin_usd.reading.picture import Picture

Value = Callable[[Picture], Any]
"""Value of a part of an expression in a picture."""

OF_NAME: Mapping[str, Value] = {
    "frame": lambda picture: picture.frame,
    "variant": lambda picture: picture.variant,
    "index": lambda picture: picture.index,
}
OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: lambda value, other: value == value and value != other,
    ast.In: lambda value, among: value in among,
    ast.NotIn: lambda value, among: value not in among,
    ast.Add: lambda value, other: _number(value) + _number(other),
    ast.Sub: lambda value, other: _number(value) - _number(other),
    ast.Mult: lambda value, other: _number(value) * _number(other),
    ast.Div: lambda value, by: _number(value) / _number(by) if by else nan,
    ast.USub: lambda value: -_number(value),
    ast.Not: operator.not_,
}
MAX_CHARACTERS = 2000
EXAMPLE = 'write it like "range < 8 and visible > 0.5"'


def _number(value: Any) -> float:
    """Return the value as a double, whose arithmetic takes no time and no memory. Raises TypeError, OverflowError."""
    if not isinstance(value, int | float):
        raise TypeError(f"{str(value)[:40]!r} is not a number")
    return float(value)


class Condition:
    """Test of whether a picture of a dataset meets a condition. A value that a record lacks is NaN, which is neither
    less than anything, nor more, nor equal, nor unequal."""

    def __init__(self, text: str, description: Description) -> None:
        """Read the condition in the `text`. Raises InputError for invalid text."""
        self._text, self._targets = text, [target.name for target in description.targets]
        self._found: dict[str, bool] = {}
        if len(text) > MAX_CHARACTERS:
            raise InputError(f"a condition of {len(text)} characters is too long", do=f"{MAX_CHARACTERS} are read")
        try:
            self._whole = self.value(ast.parse(text.strip(), mode="eval").body)
        except InputError:
            raise
        except (SyntaxError, ValueError, RecursionError, MemoryError) as e:
            raise InputError(f"{text!r} is not a condition ({getattr(e, 'msg', e)})", do=EXAMPLE) from None

    def __call__(self, picture: Picture) -> bool:
        """Return whether the picture meets it. Raises InputError for values that cannot be compared."""
        try:
            return bool(self._whole(picture))
        except (TypeError, OverflowError) as e:
            of = f"{picture.frame} of {picture.variant}"
            raise InputError(
                f"{self._text!r} cannot be tested on {of} ({e})", do="compare numbers with numbers"
            ) from None

    def refuse_never_found(self) -> None:
        """Raise InputError if the condition names a value that no tested record had."""
        for path, found in self._found.items():
            if not found:
                raise self._unknown(path, "is in no picture's record", "see a file of records/ for its values")

    def value(self, node: ast.AST) -> Value:
        """Return the value of that part in a picture. Raises InputError for invalid parts of a condition."""
        match node:
            case ast.Constant(value=str() | int() | float() as constant):
                return lambda _: constant
            case ast.Name(id=name):
                return self._named(name)
            case ast.Attribute() | ast.Subscript():
                return self._reached(node)
            case ast.List(elts=parts) | ast.Tuple(elts=parts):
                among = [self.value(part) for part in parts]
                return lambda picture: [each(picture) for each in among]
            case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
                return self._applied(op, [operand])
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                return self._applied(op, [left, right])
            case ast.BoolOp(op=op, values=parts):
                every, holds = [self.value(part) for part in parts], all if isinstance(op, ast.And) else any
                return lambda picture: holds(each(picture) for each in every)
            case ast.Compare(left=left, ops=ops, comparators=rights):
                sides = [left, *rights]
                pairs = [self._applied(op, sides[i : i + 2]) for i, op in enumerate(ops) if type(op) in OPERATORS]
                if len(pairs) == len(ops):
                    return lambda picture: all(each(picture) for each in pairs)
        raise self._unknown(ast.unparse(node), "is not read in a condition", EXAMPLE)

    def _applied(self, op: ast.AST, nodes: Iterable[ast.AST]) -> Value:
        function, parts = OPERATORS[type(op)], [self.value(node) for node in nodes]
        return lambda picture: function(*(part(picture) for part in parts))

    def _named(self, name: str) -> Value:
        if name in OF_NAME:
            return OF_NAME[name]
        if name in OF_PICTURE or name in MEASURES:
            measure = (OF_PICTURE | MEASURES)[name]
            return lambda picture: float(measure.of(picture, picture.targets[0]))
        known = ", ".join((*OF_NAME, *OF_PICTURE, *MEASURES))
        do = f"choose among {known}; of a target as {self._targets[0]}.range; of the record as record.sun.obscured"
        raise self._unknown(name, "is not a value of a picture", do)

    def _reached(self, node: ast.Attribute | ast.Subscript) -> Value:
        """Return the value at a path: a measure of a target of that name, or the record's value."""
        first, *steps = self._path(node)
        if first == "record":
            return self._recorded(ast.unparse(node), steps)
        if first in self._targets:
            if len(steps) == 1 and steps[0] in MEASURES:
                measure = MEASURES[str(steps[0])]
                return lambda picture: float(measure.of(picture, picture.targets[str(first)]))
            raise self._unknown(ast.unparse(node), "is not a value of a target", f"choose among {', '.join(MEASURES)}")
        raise self._unknown(str(first), "is not a target", f"choose among {', '.join(self._targets)}, or write record")

    def _recorded(self, path: str, steps: Sequence[str | int]) -> Value:
        self._found[path] = False

        def reached(picture: Picture) -> Any:
            value: Any = picture.record
            for step in steps:
                try:
                    value = value[step]
                except (KeyError, IndexError, TypeError):
                    return nan
            self._found[path] = True
            return nan if value is None else value

        return reached

    def _path(self, node: ast.AST) -> list[str | int]:
        match node:
            case ast.Name(id=name):
                return [name]
            case ast.Attribute(value=inner, attr=name):
                return [*self._path(inner), name]
            case ast.Subscript(value=inner, slice=ast.Constant(value=str() | int() as key)):
                return [*self._path(inner), key]
        raise self._unknown(ast.unparse(node), "is not a path to a value", "write it like record.targets[0].range")

    def _unknown(self, what: str, found: str, do: str) -> InputError:
        return InputError(f"{what!r} in the condition {self._text!r} {found}", do=do)
