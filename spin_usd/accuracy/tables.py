"""Tables as text: of cells, all strings, row by row."""

from collections.abc import Sequence


def in_columns(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table aligned for a terminal: the first column to the left, the others to the right."""
    lines = [headings, *rows]
    widths = [max(len(cells[column]) for cells in lines) for column in range(len(headings))]
    return "\n".join(
        "  ".join((first.ljust(widths[0]), *(c.rjust(w) for c, w in zip(rest, widths[1:], strict=True))))
        for first, *rest in lines
    )


def in_markdown(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown: the first column to the left, the others to the right; ends with a line break."""
    rule = ["---", *["---:"] * (len(headings) - 1)]
    lines = ([cell.replace("|", "\\|") for cell in cells] for cells in (headings, rule, *rows))
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def percent(value: float) -> str:
    """Return a share in percent."""
    return f"{number(100 * value)} %"


def within(value: float, uncertainty: float) -> str:
    """Return a value with its uncertainty, of two digits."""
    return f"{number(value)} ± {uncertainty:.2g}" if uncertainty < 99.5 else f"{number(value)} ± {uncertainty:.0f}"


def number(value: float) -> str:
    """Return a number of three digits, and from 1000 on of all before the point; a power of ten only below 0.0001."""
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"
