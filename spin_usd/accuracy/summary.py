"""The named choices of a measurement, and their outcomes: setting, cost, errors."""

from collections.abc import Iterator

from spin_usd.accuracy.choice import choose
from spin_usd.accuracy.front import Criterion, Outcome, outcomes
from spin_usd.accuracy.lookup import outcome_of
from spin_usd.accuracy.measurement import Configuration, Measurement
from spin_usd.accuracy.tables import in_markdown, number, percent
from spin_usd.errors import InputError
from spin_usd.scene.effort import QUALITIES, Effort

PLAIN = Effort(samples=64)
"""What a choice is held against: so many samples of every pixel, and nothing else."""
ASKED_PLAIN = f"--effort {PLAIN.text}"
AUTOMATIC = "--error auto"
HEADINGS = (
    *("asked", "setting", "CPU s", f"beside {PLAIN.text}", "error", "error, DN", "detector's noise, DN"),
    "both together, DN",
)


def by_name(measurement: Measurement) -> Iterator[tuple[str, Outcome | None]]:
    """Yield the named qualities, `--error auto` and PLAIN, each with its outcome; None where it was not measured on all
    pictures, or no setting is good enough."""
    asked = {f"--quality {name}": effort for name, effort in QUALITIES.items()} | {ASKED_PLAIN: PLAIN}
    for name, effort in asked.items():
        yield name, outcome_of(measurement, Configuration(renderer="blender", effort=effort))
    yield AUTOMATIC, _automatic(measurement)


def choices(measurement: Measurement) -> str:
    """Return the named choices as a table in Markdown."""
    return in_markdown(HEADINGS, list(_rows(measurement)))


def _rows(measurement: Measurement) -> Iterator[list[str]]:
    named = dict(by_name(measurement))
    plain, measured = named[ASKED_PLAIN], bool(outcomes(measurement))
    for asked, outcome in named.items():
        if outcome is None:
            yield [
                f"`{asked}`",
                "never reached" if measured and asked == AUTOMATIC else "not measured",
                *[""] * (len(HEADINGS) - 2),
            ]
            continue
        error, noise = outcome.in_image
        share = percent(outcome.cpu_s / plain.cpu_s) if plain else ""
        cells = [f"`{asked}`", f"`{outcome.setting.text}`", number(outcome.cpu_s), share]
        together = (error**2 + noise**2) ** 0.5
        errors = [percent(outcome.error(Criterion.LIGHT).expected), number(error), number(noise), number(together)]
        yield [*cells, *errors]


def _automatic(measurement: Measurement) -> Outcome | None:
    try:
        return choose(measurement, auto=True).outcome
    except InputError:
        return None
