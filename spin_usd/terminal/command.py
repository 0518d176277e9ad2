"""A command that refuses an option given twice, where typer silently takes the last, and a path that is empty or a
URL, which it takes for a folder; and shows flags as flags."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption

from spin_usd.files.url import refuse_unless_path
from spin_usd.terminal.help_text import help_text

OUT = "out"
"""The option that is a path, or of some commands a URL too; it may never be empty."""


def with_plain_flags(params: list[Any]) -> list[Any]:
    """Return the `params` with flags that show no value in the help, where typer shows "<bool>", and that are False by
    default, where typer has None for --help and loads pydantic, 0.1 s, to convert it."""
    for param in params:
        if getattr(param, "is_flag", False):
            param.metavar = param.metavar or ""
            param.default = param.default or False
    return params


class PlainValue:
    """The converter of values of `param` for typer: correct values stay unchanged, and paths are made from text here.
    `of_typer` returns the converter of any other, such as a number's text, for which typer loads pydantic, 0.1 s before
    the command begins."""

    def __init__(self, param: Any, of_typer: Callable[[], Any]) -> None:
        self._kind, self._lists = param.type_descriptor.annotation, param.multiple or param.nargs == -1
        self._of_typer = of_typer

    def coerce(self, value: Any, **of: Any) -> Any:
        """Return the value of the parameter, as typer's own does."""
        if value is None:
            return () if self._lists else None
        if not self._lists and isinstance(value, self._kind):
            return value
        if self._kind is Path and isinstance(value, str):
            return Path(value)
        return self._of_typer().coerce(value, **of)


class Group(TyperGroup):
    """The group of all commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        return with_plain_flags(super().get_params(ctx))

    def get_help(self, ctx: Any) -> str:
        return help_text(super().get_help(ctx))


class Command(TyperCommand):
    """One command. It raises typer.BadParameter, which is wrong usage, for a repeated option that holds one value, and
    InputError for a path that is empty, or a URL where that is not allowed."""

    def __init__(self, *args: Any, **of: Any) -> None:
        super().__init__(*args, **of)
        params: list[Any] = self.params
        for param in params:
            param.get_runtime_param = partial(PlainValue, param, param.get_runtime_param)

    def get_params(self, ctx: Any) -> list[Any]:
        return with_plain_flags(super().get_params(ctx))

    def get_help(self, ctx: Any) -> str:
        return help_text(super().get_help(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if ctx.resilient_parsing:
            return self._words(ctx, args)
        values, _, given = self.make_parser(ctx).parse_args(args=list(args))
        params = [param for param in given if isinstance(param, TyperOption | TyperArgument)]
        options = [param for param in params if isinstance(param, TyperOption)]
        for option in options:
            if options.count(option) > 1 and not (option.is_flag or option.multiple):
                raise typer.BadParameter("is given more than once", ctx=ctx, param=option)
        paths = self._paths()
        for param in params:
            for path in _each(values[param.name]) if param.name in paths or param.name == OUT else ():
                if path == "" or (isinstance(path, str) and param.name in paths):  # typer marks missing values
                    refuse_unless_path(path, _name(param))
        return super().parse_args(ctx, args)

    def _words(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the words of a line that a shell completes into the context unconverted, and return those left over. To
        convert them, typer would load pydantic: 0.1 s for each press of Tab."""
        values, ctx.args, _ = self.make_parser(ctx).parse_args(args=list(args))
        for param in self.get_params(ctx):
            ctx.params[param.name], source = param.consume_value(ctx, values)
            ctx.set_parameter_source(param.name, source)
        left: list[str] = ctx.args
        return left

    def _paths(self) -> set[str]:
        """Return the names of the parameters that hold one path or several."""
        hints = get_type_hints(self.callback)
        return {name for name, hint in hints.items() if Path in (hint, *get_args(hint))}


def _name(param: TyperOption | TyperArgument) -> str:
    """Return the user's name for it: --out, or SHARD."""
    return param.opts[0] if isinstance(param, TyperOption) else str(param.metavar or param.name)


def _each(value: Any) -> tuple[Any, ...]:
    return tuple(value) if isinstance(value, list | tuple) else (value,)
