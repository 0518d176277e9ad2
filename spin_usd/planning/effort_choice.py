"""Choose a render's effort for a wanted result, a named quality or an error, and give the reason."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from msgspec import UNSET, Meta

from spin_usd.accuracy.choice import choose, expectation, outcome_of
from spin_usd.accuracy.front import Criterion, Outcome
from spin_usd.accuracy.measurement import Configuration, Measurement
from spin_usd.basics.json_fields import Size
from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.files.sha256 import sha256_of
from spin_usd.options import EffortOptions, refuse_together
from spin_usd.processes.open_renderer import DEFAULT_RENDERER, default_effort, renderer_entry
from spin_usd.records.record import EffortChoice, StageProvenance
from spin_usd.scene.effort import QUALITIES, Effort, parse_effort
from spin_usd.store.measurement_file import measurement_file, read_measurement


@dataclass(frozen=True, kw_only=True)
class Basis:
    """The measurement behind a choice: its file's sha256, and the stage's variant and hash that it is of."""

    sha256: str
    variant: str
    stage: str


@dataclass(frozen=True, kw_only=True)
class Expected:
    """The figures of a setting, as measured, of the worst picture."""

    error: Annotated[Size, Meta(description="Relative error, in linear light.")]
    error_at_most: Annotated[Size, Meta(description="Upper bound of the error.")]
    error_dn: Annotated[Size, Meta(description="Error after the detector, digital numbers of the image.")]
    noise_dn: Annotated[Size, Meta(description="The detector's own noise, digital numbers.")]
    cpu_s: Annotated[Size, Meta(description="Seconds of one core a picture.")]

    @classmethod
    def of(cls, outcome: Outcome) -> "Expected":
        error, at_most = outcome.error(Criterion.LIGHT)
        error_dn, noise_dn = outcome.in_image
        return cls(error=error, error_at_most=at_most, error_dn=error_dn, noise_dn=noise_dn, cpu_s=outcome.cpu_s)


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """The reason for a render's effort."""

    by: str
    """"quality" or "error"."""
    asked: str
    """Choice in the user's words."""
    reason: str
    """A sentence."""
    basis: Basis | None = None
    """The measurement, if there is one."""
    expected: Expected | None = None
    """Its figures of the setting."""
    note: str = ""
    """A sentence of the measurement on a quality, for the measured stage alone; "" for none."""

    @property
    def recorded(self) -> EffortChoice:
        """The choice by schema record-1."""
        measurement = self.basis.sha256 if self.basis and self.by == "error" else UNSET
        return EffortChoice(by=self.by, asked=self.asked, reason=self.reason, measurement=measurement)

    def is_of(self, stages: Mapping[str, StageProvenance]) -> bool:
        """Return whether the measurement is of one of the `stages`: provenance by variant."""
        basis = self.basis
        return basis is not None and basis.variant in stages and stages[basis.variant].hash == basis.stage


def by_quality(name: str, stage: Path, *, renderer: str) -> tuple[Effort, Chosen]:
    """Return the effort of the quality `name`, with its figures in the measurement beside the `stage`. Raises
    InputError if there is no such quality."""
    if name not in QUALITIES:
        raise InputError(f"there is no quality {name!r}", do=suggestion(name, QUALITIES))
    effort = QUALITIES[name]
    chosen = Chosen(by="quality", asked=name, reason=f"the quality {name} is {effort.text}")
    try:
        file = measurement_file(stage)
        measurement = read_measurement(file)
    except InputError:
        return effort, chosen
    outcome = outcome_of(measurement, Configuration(renderer=renderer, effort=effort))
    if outcome is None:
        return effort, chosen
    text = f"the quality {name}: {expectation(measurement, outcome)}"
    basis = _basis(measurement, file)
    return effort, replace(chosen, basis=basis, expected=Expected.of(outcome), note=text)


def by_error(asked: str, file: Path, *, renderer: str) -> tuple[Configuration, Chosen]:
    """Return the cheapest setting of `renderer` in the measurement in `file` with an error of at most `asked`, a number
    or "auto". Raises InputError if there is none."""
    bound = error_bound(asked)
    measurement = read_measurement(file)
    choice = choose(measurement, error=bound, auto=bound is None, renderer=renderer)
    basis, expected = _basis(measurement, file), Expected.of(choice.outcome)
    return choice.setting, Chosen(by="error", asked=asked, reason=choice.reason, basis=basis, expected=expected)


def doubts(chosen: Chosen | None, stages: Mapping[str, StageProvenance]) -> list[str]:
    """Return sentences on reasons why errors may differ from the measured ones, and on the measured quality. `stages`:
    provenance by variant."""
    if chosen is None or chosen.basis is None or (chosen.by == "quality" and not chosen.is_of(stages)):
        return []
    basis, doubts = chosen.basis, [chosen.note] if chosen.note else []
    if basis.variant in stages and not chosen.is_of(stages):
        doubts.append("the measurement is of the stage as it was, or of another; run spin-usd measure to have its own")
    if {*stages} != {basis.variant}:
        doubts.append(f"only the variant {basis.variant} was measured; errors in others may be greater")
    return doubts


def _basis(measurement: Measurement, file: Path) -> Basis:
    return Basis(sha256=sha256_of(file), variant=measurement.variant, stage=measurement.stage)


def error_bound(asked: str) -> float | None:
    """Return the largest error that `asked` allows; None for "auto". Raises InputError for any other text."""
    if asked == "auto":
        return None
    with suppress(ValueError):
        if "_" not in asked:  # which Python allows between digits
            return float(asked)
    raise InputError(f"error is {asked!r}", do="make it a number above 0, such as 0.05 for 5 %, or auto")


def setting_of(
    stage: Path,
    options: EffortOptions,
    *,
    renderer: str | None,
    error: str | None = None,
    measured: Path | None = None,
) -> tuple[Configuration, Chosen | None]:
    """Return the renderer, blender if not given, the effort by the `options` or an `error`, and the reason if it was
    chosen. Raises InputError for options that do not go together."""
    samples, effort, quality = options.samples, options.effort, options.quality
    refuse_together(samples=samples, effort=effort, quality=quality, error=error)
    if measured is not None and error is None:
        raise InputError("measured is given without error", do="give error too")
    renderer = renderer or DEFAULT_RENDERER
    if error is not None:
        error_bound(error)  # a wrong one is refused before a missing measurement
        return by_error(error, measurement_file(stage, measured), renderer=renderer)
    chosen = None
    usual = default_effort(renderer)
    tried = usual if samples is None else replace(usual, samples=samples)
    if effort is not None:
        tried = parse_effort(_said(effort))
    if quality is not None:
        tried, chosen = by_quality(quality, stage, renderer=renderer)
        _refuse_unsupported(quality, tried, renderer)
    return Configuration(renderer=renderer, effort=tried), chosen


def _said(effort: str) -> str:
    if not effort.strip():
        raise InputError("effort is empty", do="write name=value,..., such as samples=16,denoiser=fast")
    return effort


def _refuse_unsupported(quality: str, effort: Effort, renderer: str) -> None:
    if unused := set(effort.unusual) - renderer_entry(renderer).effort:
        found = f"quality {quality!r} needs {DEFAULT_RENDERER}: {renderer} has no {' and no '.join(sorted(unused))}"
        raise InputError(found, do=f"choose another renderer than {renderer}, or give samples instead")
