"""A measurement as text: all of it in Markdown, and its settings alone for a terminal."""

from collections.abc import Iterator

from spin_usd.accuracy.choice import choose, most_exact, outcome_of
from spin_usd.accuracy.error import FLOOR
from spin_usd.accuracy.front import Criterion, Outcome, front, outcomes
from spin_usd.accuracy.measurement import Configuration, Measurement
from spin_usd.accuracy.tables import in_columns, in_markdown, number, percent, within
from spin_usd.errors import InputError
from spin_usd.scene.effort import QUALITIES, Effort

SETTINGS = (
    *("setting", "front", "CPU s", "wall s", "memory, MB", "error", "of it bias", "of it noise", "brightness"),
    *("error, DN", "detector's noise, DN", "structure"),
)
SHORT = ("setting", "front", "CPU s", "MB", "error", "bias", "noise", "DN", "detector's DN")
FRAMES = ("picture", "region", "target's pixels", "reference's samples", "reference's error", "detector's noise, DN")
LABELS = ("picture", "pass of", "against", "IoU", "depth, m", "reprojection, px", "part, pixels")
EXECUTION = ("processes x threads", "crop to the region", "wall s", "same bytes")
FAILURES = ("what", "picture", "why")
SAVINGS = ("skipped", "picture", "CPU s without", "CPU s with", "with / without", "difference", "another seed's")
MEANINGS = f"""
Seconds are per picture, the mean of the pictures; errors are of the picture with the largest possible error. Error:
relative, in linear light: for each of the target's pixels, its deviation over the root of its radiance squared plus the
square of {FLOOR:g} x the target's mean; root mean square; then its increase by the uncertainty of its square: the
standard error over the seeds, and the reference's own error if that took as many samples as allowed. The square is the
sum of the squares of bias and noise; a bias within the uncertainty is shown as 0. Brightness: relative change of the
target's light. DN: digital numbers after the detector, with its increase likewise, next to the detector's own noise,
which the error does not contain. Structure: 1 - SSIM. Front: no other setting is as cheap and surely as exact, in
linear light (`light`) or after the detector (`image`); `--error` chooses from it.
"""

PLAIN = Effort(samples=64)
"""Setting that a choice is compared with: samples of every pixel, and nothing else."""
ASKED_PLAIN = f"--effort {PLAIN.text}"
AUTOMATIC = "--error auto"
HEADINGS = (
    *("asked", "setting", "CPU s", f"beside {PLAIN.text}", "error", "error, DN", "detector's noise, DN"),
    "both together, DN",
)


def in_full(measurement: Measurement) -> str:
    """Return the whole measurement in Markdown."""
    tables = (
        ("Pictures and their references", FRAMES, _frames(measurement)),
        ("Labels, by one pass against another", LABELS, _labels(measurement)),
        ("Execution, which changes no byte", EXECUTION, _execution(measurement)),
        ("Work that the scene does not need", SAVINGS, _savings(measurement)),
        ("Failed measurements", FAILURES, _failures(measurement)),
    )
    settings = in_markdown(SETTINGS, [_full(each, on) for each, on in _by_cost(measurement)])
    parts = [_heading(measurement), MEANINGS, "\n## Settings\n\n", settings, "\n## By name\n\n", choices(measurement)]
    for title, headings, cells in tables:
        rows = list(cells)
        parts += [f"\n## {title}\n\n", in_markdown(headings, rows)] if rows else []
    return "".join(parts)


def in_short(measurement: Measurement) -> str:
    """Return the measurement's settings in aligned columns, the cheapest first."""
    return in_columns(SHORT, [_short(each, on) for each, on in _by_cost(measurement)])


def _heading(measurement: Measurement) -> str:
    facts = {**measurement.machine, **measurement.versions}
    said = ", ".join(f"{name} {value}" for name, value in facts.items())
    of = f"variant `{measurement.variant}` of the stage `{measurement.stage[:12]}`"
    share = (
        f"Each reference's mean square error is at most {number(measurement.reference_share)} of the smallest compared"
    )
    return f"# Speed against accuracy\n\nMeasured on {of}; {said}.\n{share} with it, unless stated otherwise below.\n"


def _by_cost(measurement: Measurement) -> list[tuple[Outcome, str]]:
    """Return the settings, the cheapest first, and the fronts that each is of."""
    found = outcomes(measurement)
    fronts = {each.value: front(found, each) for each in Criterion}
    on = [" ".join(name for name, best in fronts.items() if each in best) for each in found]
    return sorted(zip(found, on, strict=True), key=lambda pair: pair[0].cpu_s)


def _full(outcome: Outcome, on: str) -> list[str]:
    every, (error, noise) = outcome.figures, _in_image(outcome)
    brightness = max((each.brightness for each in every), key=abs)
    return [
        f"`{outcome.setting.text}`",
        on,
        number(outcome.cpu_s),
        number(sum(each.wall_s for each in every) / len(every)),
        _megabytes(outcome),
        *_errors(outcome),
        percent(brightness),
        error,
        noise,
        number(max(each.structure for each in every)),
    ]


def _short(outcome: Outcome, on: str) -> list[str]:
    megabytes, errors = _megabytes(outcome), _errors(outcome)
    return [outcome.setting.text, on, number(outcome.cpu_s), megabytes, *errors, *_in_image(outcome)]


def _megabytes(outcome: Outcome) -> str:
    return f"{max(each.memory_bytes for each in outcome.figures) / 1e6:.0f}"


def _errors(outcome: Outcome) -> list[str]:
    """Error, bias and noise of the worst picture."""
    worst = outcome.figures[outcome.worst(Criterion.LIGHT)]
    error = within(100 * worst.error, 100 * (worst.error_at_most - worst.error))
    return [f"{error} %", percent(worst.bias), percent(worst.variance**0.5)]


def _in_image(outcome: Outcome) -> tuple[str, str]:
    """Error after the detector and the detector's own noise, of the worst picture."""
    place = outcome.worst(Criterion.IMAGE)
    worst = outcome.figures[place]
    return within(worst.error_dn, worst.error_dn_uncertainty), number(outcome.noise_dn[place])


def _frames(measurement: Measurement) -> Iterator[list[str]]:
    for each in measurement.frames:
        region = " ".join(map(str, each.region))
        capped = " (no more allowed)" if each.reference_capped else ""
        reference = [f"{each.reference_samples}{capped}", percent(each.reference_error)]
        yield [each.name, region, str(each.target_pixels), *reference, number(each.noise_dn)]


def _labels(measurement: Measurement) -> Iterator[list[str]]:
    for each in measurement.labels:
        worst = [f"{each.depth_m:.1e}", f"{each.reprojection_px:.1e}", str(each.part_pixels)]
        yield [each.frame, each.renderer, each.against, f"{each.iou:.6f}", *worst]


def _execution(measurement: Measurement) -> Iterator[list[str]]:
    for each in measurement.execution:
        crop, same = ("yes" if well else "no" for well in (each.crop, each.same))
        yield [f"{each.processes} x {each.threads}", crop, number(each.wall_s), same]


def _savings(measurement: Measurement) -> Iterator[list[str]]:
    for each in measurement.savings:
        seconds = [number(each.cpu_s), number(each.cpu_s_with)]
        ratios = f"{number(each.ratio_least)} to {number(each.ratio_most)}"
        yield [each.what, each.frame, *seconds, ratios, percent(each.difference), percent(each.noise)]


def _failures(measurement: Measurement) -> Iterator[list[str]]:
    for each in measurement.failures:
        yield [each.what, each.frame, each.reason]


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
