"""How hard a render tries where it is asked for a result instead, a named quality or an error; and why."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spin_usd.dataset.measure.file import read_measurement
from spin_usd.dataset.store import sha256_of
from spin_usd.errors import InputError
from spin_usd.measuring.choice import choose
from spin_usd.measuring.measurement import Setting
from spin_usd.scene.effort import QUALITIES, Effort


@dataclass(frozen=True, kw_only=True)
class Basis:
    """The measurement behind a choice: its file's sha256, and the stage's variant and hash that it is of."""

    sha256: str
    variant: str
    stage: str


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """Why a render tries as hard as it does. by: "quality" or "error" · asked: in the user's words · reason: a
    sentence · basis: the measurement; None for a quality."""

    by: str
    asked: str
    reason: str
    basis: Basis | None = None

    @property
    def recorded(self) -> dict[str, str]:
        """By schema record-1."""
        said = {"by": self.by, "asked": self.asked, "reason": self.reason}
        return said | ({"measurement": self.basis.sha256} if self.basis else {})

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Chosen":
        """Of what `dataclasses.asdict` made of it."""
        basis = value["basis"]
        return cls(**{**value, "basis": Basis(**basis) if basis else None})


def by_quality(name: str) -> tuple[Effort, Chosen]:
    """Raises InputError for a name that no quality has."""
    if name not in QUALITIES:
        raise InputError(f"there is no quality {name!r}", do=f"choose among {', '.join(QUALITIES)}")
    effort = QUALITIES[name]
    return effort, Chosen(by="quality", asked=name, reason=f"the quality {name} is {effort.text}")


def by_error(asked: str, file: Path, *, renderer: str | None = None) -> tuple[Setting, Chosen]:
    """The cheapest setting of the measurement in `file` with an error of at most `asked`, a number or "auto"; of
    `renderer` alone where it is given. Raises InputError where there is none."""
    measurement = read_measurement(file)
    bound = None if asked == "auto" else _number(asked)
    choice = choose(measurement, error=bound, auto=bound is None, renderer=renderer)
    basis = Basis(sha256=sha256_of(file), variant=measurement.variant, stage=measurement.stage)
    return choice.setting, Chosen(by="error", asked=asked, reason=choice.reason, basis=basis)


def doubts(chosen: Chosen | None, stages: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """What may make errors others than those that were measured. `stages`: by variant, what records say of it."""
    if chosen is None or chosen.basis is None:
        return []
    basis, said = chosen.basis, []
    if basis.variant in stages and stages[basis.variant]["hash"] != basis.stage:
        said.append("the measurement is of the stage as it was, or of another; run spin-usd measure to have its own")
    if {*stages} != {basis.variant}:
        said.append(f"only the variant {basis.variant} was measured; errors in others may be greater")
    return said


def _number(asked: str) -> float:
    try:
        return float(asked)
    except ValueError:
        do = "make it a number above 0, such as 0.05 for 5 %, or auto"
        raise InputError(f"--error is {asked!r}", do=do) from None
