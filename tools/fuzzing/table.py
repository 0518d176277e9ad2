"""The table of a campaign, as Markdown."""

from collections import Counter

from fuzzing.mutation.subjects import SUBJECTS
from fuzzing.results import Results
from fuzzing.trial import Verdict

COLUMNS = tuple(Verdict)
GROUPS = {subject.name: f"mutants: {subject.group}" for subject in SUBJECTS}


def table(results: Results) -> str:
    """A line for each class of the corpus and each group of mutated formats, and their sum."""
    lines = [
        "| class | inputs | " + " | ".join(COLUMNS) + " |",
        "| --- | " + " | ".join(["---:"] * (len(COLUMNS) + 1)) + " |",
    ]
    groups: dict[str, Counter[Verdict]] = {}
    for kind, counts in results.by_kind.items():
        groups.setdefault(GROUPS.get(kind, kind), Counter()).update(counts)
    lines += [_line(name, counts) for name, counts in groups.items()]
    seconds, title = results.slowest
    total = sum(groups.values(), Counter[Verdict]())
    return "\n".join([*lines, _line("all", total), "", f"The slowest took {seconds:.1f} s: {title}."])


def _line(name: str, counts: Counter[Verdict]) -> str:
    numbers = [counts.total(), *(counts[verdict] for verdict in COLUMNS)]
    return f"| {name} | " + " | ".join(map(str, numbers)) + " |"
