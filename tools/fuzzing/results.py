"""What came of the inputs of a campaign."""

from collections import Counter
from dataclasses import dataclass, field

from fuzzing.trial import Verdict


@dataclass(frozen=True, kw_only=True)
class Judged:
    """An input that was tried. kind: its class or format · seconds: those of its slowest command."""

    kind: str
    verdict: Verdict
    seconds: float


@dataclass(kw_only=True)
class Results:
    """The last verdict on each input, by its title."""

    judged: dict[str, Judged] = field(default_factory=dict)

    def add(self, title: str, judged: Judged) -> None:
        """Take one in, in place of what was judged of it before."""
        self.judged[title] = judged

    def held(self, title: str) -> bool:
        """Whether this input was tried, and kept the promises."""
        return title in self.judged and self.judged[title].verdict.keeps_the_promise

    @property
    def by_kind(self) -> dict[str, Counter[Verdict]]:
        """How many of each verdict, by kind of input."""
        counts: dict[str, Counter[Verdict]] = {}
        for each in self.judged.values():
            counts.setdefault(each.kind, Counter())[each.verdict] += 1
        return counts

    @property
    def slowest(self) -> tuple[float, str]:
        """Seconds, and the input that took them."""
        return max(((each.seconds, title) for title, each in self.judged.items()), default=(0.0, ""))
