"""A command that refuses an option given twice, where typer silently takes the last."""

from typing import Any

import typer
from typer.core import TyperCommand, TyperOption


class Command(TyperCommand):
    """Raises typer.BadParameter, which is wrong usage, for a repeated option that holds one value."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        _, _, given = self.make_parser(ctx).parse_args(args=list(args))
        options = [option for option in given if isinstance(option, TyperOption)]
        for option in options:
            if options.count(option) > 1 and not (option.is_flag or option.multiple):
                raise typer.BadParameter("is given more than once", ctx=ctx, param=option)
        return super().parse_args(ctx, args)
