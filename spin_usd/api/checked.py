"""Check the types of the arguments that a function of the package is called with."""

from collections.abc import Callable, Collection, Sequence
from functools import wraps
from inspect import signature
from numbers import Integral, Real
from pathlib import Path
from types import UnionType
from typing import Any, ParamSpec, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from spin_usd.errors import InputError
from spin_usd.files.url import is_url, refuse_unless_path

P = ParamSpec("P")
R = TypeVar("R")

_NAMES = {
    str: "text",
    Path: "a path",
    int: "a whole number",
    float: "a number",
    bool: "True or False",
    type(None): "None",
}


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return the `function` such that it raises an InputError for an argument that its annotations do not allow, before
    anything is started or written. The error names the argument. No path may be empty, or a URL."""
    return checked_but_urls()(function)


def checked_but_urls(*urls: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return what `checked` is, for a function whose arguments of these names may be URLs too."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        hints = get_type_hints(function)
        names = tuple(signature(function).parameters)

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            given = [_plain(value) for value in args]
            named = {name: _plain(value) for name, value in kwargs.items()}
            for name, value in [*zip(names, given, strict=False), *named.items()]:
                if name in hints:
                    _refuse_unless_allowed(name, value, hints[name])
                    _refuse_unless_paths(name, value, hints[name], url=name in urls)
            return function(*given, **named)  # type: ignore[arg-type]

        return call

    return decorate


def _plain(value: object) -> object:
    """Return numpy's numbers and truth values as Python's; anything else as it is."""
    return value.item() if isinstance(value, np.bool_ | np.number) else value


def _refuse_unless_allowed(name: str, value: object, hint: Any) -> None:
    choices = _choices(hint)
    if not any(_is_of(value, choice) for choice in choices):
        raise InputError(f"{name} is {value!r}", do=f"make it {' or '.join(map(_name, choices))}")


def _refuse_unless_paths(name: str, value: object, hint: Any, *, url: bool) -> None:
    """Raise InputError where a path among the values is none."""
    if not {Path, Sequence[Path]} & set(_choices(hint)):
        return
    for each in value if isinstance(value, Collection) and not isinstance(value, str) else (value,):
        if isinstance(each, str | Path) and not (url and each != "" and is_url(each)):
            refuse_unless_path(each, name)


def _choices(hint: Any) -> tuple[Any, ...]:
    """Return the types that a union has; any other type is alone."""
    return get_args(hint) if isinstance(hint, UnionType) else (hint,)


def _is_of(value: object, kind: Any) -> bool:
    """Return whether the value is of that type, a plain one, a sequence or a function. True is not a number."""
    if isinstance(value, bool):
        return kind is bool
    if kind in (int, float):
        return isinstance(value, Integral if kind is int else Real)
    if isinstance(kind, type):
        return isinstance(value, kind)
    if get_origin(kind) is not Sequence:
        return callable(value)
    if isinstance(value, str | bytes) or not isinstance(value, Collection):
        return False
    return all(_is_of(each, get_args(kind)[0]) for each in value)


def _name(kind: Any) -> str:
    """Return what to call the type in a sentence."""
    if get_origin(kind) is Sequence:
        return f"a list, each {_NAMES[get_args(kind)[0]]}"
    return _NAMES.get(kind, "a function")
