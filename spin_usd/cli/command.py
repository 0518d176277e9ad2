"""A command that refuses an option given twice, where typer silently takes the last, and shows flags as flags."""

from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption


def without_types_of_flags(params: list[Any]) -> list[Any]:
    """Return the `params` with flags that say in the help that they take nothing, where typer shows "<bool>"."""
    for param in params:
        if getattr(param, "is_flag", False) and param.metavar is None:
            param.metavar = ""
    return params


class Group(TyperGroup):
    """The group of all commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        return without_types_of_flags(super().get_params(ctx))


class Command(TyperCommand):
    """One command. It raises typer.BadParameter, which is wrong usage, for a repeated option that holds one value."""

    def get_params(self, ctx: Any) -> list[Any]:
        return without_types_of_flags(super().get_params(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        _, _, given = self.make_parser(ctx).parse_args(args=list(args))
        options = [option for option in given if isinstance(option, TyperOption)]
        for option in options:
            if options.count(option) > 1 and not (option.is_flag or option.multiple):
                raise typer.BadParameter("is given more than once", ctx=ctx, param=option)
        return super().parse_args(ctx, args)
