"""Tables: drawn to fit a terminal, and lines with aligned columns in a pipe or a file."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from spin_usd.errors import printable
from spin_usd.terminal.lines import Painted, has_colours, is_terminal, print_out

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

Cell = str | Painted


def show_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on standard output: the first column to the left, the others to the right; the last row is the
    total."""
    if not is_terminal(sys.stdout):
        from spin_usd.accuracy.tables import in_columns

        print_out(*in_columns(headings, rows).split("\n"))
        return
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        box=SIMPLE_HEAD,
        pad_edge=False,
        padding=(0, 1, 0, 0),
        show_footer=len(rows) > 1,
        header_style="bold",
        footer_style="bold",
    )
    *body, total = rows
    for heading, foot in zip(headings, total, strict=True):
        table.add_column(_text(heading), _text(foot), justify="right" if table.columns else "left", overflow="fold")
    for row in body:
        table.add_row(*map(_text, row))
    _draw(table)


def show_grid(rows: Sequence[Sequence[Cell]], *, indent: int = 0) -> None:
    """Print rows of cells on a terminal: columns as wide as they need to be, long texts folded within theirs."""
    from rich.padding import Padding
    from rich.table import Table

    grid = Table.grid(padding=(0, 2, 0, 0))
    for _ in rows[0]:
        grid.add_column(overflow="fold")
    for row in rows:
        grid.add_row(*map(_text, row))
    _draw(Padding(grid, (0, 0, 0, indent)))


def _text(cell: Cell) -> "Text":
    """Return the cell, which may come from anywhere, as text in which nothing is markup."""
    from rich.text import Text

    if isinstance(cell, str):
        return Text(printable(cell))
    return Text(printable(cell.text), style=" ".join(filter(None, ["bold" * cell.bold, cell.colour or ""])))


def _draw(what: "RenderableType") -> None:
    from rich.console import Console

    Console(no_color=not has_colours(sys.stdout), highlight=False).print(what)
