"""The named choices of a measurement, and their outcomes: setting, cost, errors."""

from collections.abc import Iterator

from spin_usd.accuracy.choice import choose, most_exact
from spin_usd.accuracy.front import Criterion, Outcome
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
    plain = named[ASKED_PLAIN]
    for asked, outcome in named.items():
        if outcome is not None:
            yield [f"`{asked}`", f"`{outcome.setting.text}`", *_figures(outcome, plain)]
        elif asked == AUTOMATIC and (nearest := most_exact(measurement)) is not None:
            yield [f"`{asked}`", f"never reached; nearest is `{nearest.setting.text}`", *_figures(nearest, plain)]
        else:
            yield [f"`{asked}`", "not measured", *[""] * (len(HEADINGS) - 2)]


def _figures(outcome: Outcome, plain: Outcome | None) -> list[str]:
    """Return the cells of HEADINGS from the cost on."""
    error, noise = outcome.in_image
    share = percent(outcome.cpu_s / plain.cpu_s) if plain else ""
    together = (error**2 + noise**2) ** 0.5
    light = percent(outcome.error(Criterion.LIGHT).expected)
    return [number(outcome.cpu_s), share, light, number(error), number(noise), number(together)]


def _automatic(measurement: Measurement) -> Outcome | None:
    try:
        return choose(measurement, auto=True).outcome
    except InputError:
        return None
