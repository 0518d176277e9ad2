"""The table of a campaign, as Markdown."""

from fuzzing.campaign import Results
from fuzzing.trial import Verdict

COLUMNS = tuple(Verdict)


def table(results: Results) -> str:
    """A line for each kind of input, and their sum."""
    lines = [
        "| class | inputs | " + " | ".join(COLUMNS) + " |",
        "| --- | " + " | ".join(["---:"] * (len(COLUMNS) + 1)) + " |",
    ]
    total: dict[Verdict, int] = dict.fromkeys(COLUMNS, 0)
    for kind, counts in results.by_kind.items():
        lines.append(_line(kind, counts))
        for verdict, count in counts.items():
            total[verdict] += count
    seconds, title = results.slowest
    return "\n".join([*lines, _line("all", total), "", f"The slowest took {seconds:.1f} s: {title}."])


def _line(kind: str, counts: dict[Verdict, int]) -> str:
    numbers = [sum(counts.values()), *(counts.get(verdict, 0) for verdict in COLUMNS)]
    return f"| {kind} | " + " | ".join(map(str, numbers)) + " |"
