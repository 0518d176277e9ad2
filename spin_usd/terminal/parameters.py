"""Typer's parameters of a command, made of its `spin_usd.options`."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import Field, fields
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer

from spin_usd.options import Argument, Option, Options, described, flag_of, required

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object for programs.")]
OPTIONS = "options"
"""The parameter of a command that represents all fields of its type, a dataclass of options."""


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command in typer's form: with a parameter for each field of the type of its `options`, and typer's
    annotations on its own parameters that are options.

    If that type is `X | None`, nothing is required, and the command gets None if a required value is missing.
    """
    hints, own = get_type_hints(command, include_extras=True), dict(signature(command).parameters)
    choices = get_args(hints.get(OPTIONS)) or (hints.get(OPTIONS, Options),)
    kind: type[Options] = next(each for each in choices if issubclass(each, Options))
    may_lack = len(choices) > 1
    parameters = [*_parameters(fields(kind), get_type_hints(kind, include_extras=True), may_lack=may_lack)]
    lists = {parameter.name: _is_list(parameter) for parameter in parameters}

    def callback(**given: Any) -> None:
        values = {name: given.pop(name) for name in lists}
        lacking = any(values[field.name] is None for field in fields(kind) if required(field))
        if OPTIONS in own:
            given[OPTIONS] = None if lacking else kind(**{k: v or () if lists[k] else v for k, v in values.items()})
        command(**given)

    others = [_own(each, hints[name]) for name, each in own.items() if name != OPTIONS]
    parameters = sorted([*parameters, *others], key=_place)
    callback.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    callback.__annotations__ = {each.name: each.annotation for each in parameters}
    callback.__name__, callback.__doc__ = command.__name__, command.__doc__
    return callback


def _own(parameter: Parameter, hint: Any) -> Parameter:
    """Return a command's own parameter, in typer's words where it is an option."""
    kind, option = described(hint)
    if option:
        hint = _hint(parameter.name, option, _typed(kind, option), parameter.default)
    return parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=hint)


def _parameters(of: Iterable["Field[Any]"], hints: Mapping[str, Any], *, may_lack: bool) -> Iterator[Parameter]:
    """Yield a parameter for each field that stands on the command line. may_lack: none need be given."""
    for field in of:
        hint, option = described(hints[field.name])
        if option is None:
            continue
        kind, default = _typed(hint, option), Parameter.empty if required(field) else field.default
        if default == ():
            default = "" if kind is str else None
        if may_lack and default is Parameter.empty:
            default = None
        yield Parameter(
            field.name, Parameter.KEYWORD_ONLY, default=default, annotation=_hint(field.name, option, kind, default)
        )


def _typed(hint: Any, option: Option) -> Any:
    """Return the type that a value has on the command line: text represents lists of names, unless the flag is repeated
    for each, and paths are paths, unless they may be URLs."""
    choices = get_args(hint) or (hint,)
    if get_origin(hint) is Sequence:
        return list[choices[0]]  # type: ignore[valid-type]
    if option.repeated:
        return list[Path] if Sequence[Path] in choices else list[str]
    if Path in choices and not (option.url or option.name_or_path):
        return Path
    return next(kind for kind in choices if kind in (str, bool, int, float))


def _hint(name: str, option: Option, value: Any, default: Any) -> Any:
    """Return the annotation by which typer knows an option of that type and default."""
    said: dict[str, Any] = {"help": option.help, "metavar": option.metavar or None, "autocompletion": option.words}
    said |= {"min": option.at_least, "max": option.at_most}
    flag = flag_of(name, option)
    info = typer.Argument(**said) if isinstance(option, Argument) else typer.Option(flag, **said)
    return Annotated[value | None, info] if default is None else Annotated[value, info]


def _is_list(parameter: Parameter) -> bool:
    """Return whether the value is a list, for which typer has None by default."""
    return any(
        get_origin(each) is list for each in (*get_args(get_args(parameter.annotation)[0]), parameter.annotation)
    )


def _place(parameter: Parameter) -> int:
    """Return the order of the parameter in the help: required ones first, the command line's own last."""
    if parameter.annotation is typer.Context:
        return 0
    of_typer = next((each for each in get_args(parameter.annotation)[1:]), None)
    if isinstance(of_typer, typer.models.ArgumentInfo):
        return 1
    return 2 if parameter.default is Parameter.empty else 3
