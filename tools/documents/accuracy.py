"""Blocks made of tools/figures/measure_NAME.json of the three stages, which `tools/bench stages` writes."""

from pathlib import Path

from documents.marked import NotMeasuredError, prose
from three_stages import STAGES

from spin_usd.accuracy.choice import most_exact
from spin_usd.accuracy.front import Criterion, Outcome
from spin_usd.accuracy.measurement import Measurement
from spin_usd.accuracy.report import ASKED_PLAIN, AUTOMATIC, PLAIN, by_name, in_full
from spin_usd.accuracy.tables import in_markdown, number, percent, within
from spin_usd.scene.effort import QUALITIES
from spin_usd.store.measurement_file import read_measurement

PICTURED = "sunlamp"  # by tools/build_quality_picture


def measurements(folder: Path) -> dict[str, Measurement]:
    files = {name: folder / f"measure_{name}.json" for name in STAGES}
    if lacking := [name for name, file in files.items() if not file.is_file()]:
        raise NotMeasuredError(f"run tools/bench stages --stages {' '.join(lacking)}")
    return {name: read_measurement(file) for name, file in files.items()}


def qualities(folder: Path) -> str:
    """Return what the named qualities, plain samples and `--error auto` come to on each stage."""
    named = {stage: dict(by_name(found)) for stage, found in measurements(folder).items()}
    asked = next(iter(named.values()))
    rows = [[f"`{name}`", *(_cell(of[name]) for of in named.values())] for name in asked if name != AUTOMATIC]
    found = measurements(folder)
    rows.append([f"`{AUTOMATIC}`", *(_chosen(of, found[stage]) for stage, of in named.items())])
    pictures = max(len(found.frames) for found in measurements(folder).values())
    note = (
        f"Of {pictures} {'picture' if pictures == 1 else 'pictures'} of each stage: CPU seconds a picture · relative "
        "error in linear light, of the worst picture; "
        f"for `{AUTOMATIC}` what it chose · its share of the time of `{PLAIN.text}` · the image's error with the "
        "detector's noise in it, digital numbers, beside that one's:"
    )
    plot = "![Error against CPU seconds on the stage sunlamp](../images/measure_sunlamp.svg)"
    tables = ", ".join(f"[{stage}](../../tools/figures/measure_{stage}.md)" for stage in named)
    ends = f"{prose(_references(folder))}\n\n{plot}\n\n{prose(f'All settings: {tables}.')}"
    return f"{prose(note)}\n\n{in_markdown(('', *named), rows)}\n{ends}"


def quality_picture(folder: Path) -> str:
    """Return the picture of the qualities, with what each comes to on its stage."""
    named = dict(by_name(measurements(folder)[PICTURED]))
    figures = ", ".join(f"`{name}` ({_cell(named[f'--quality {name}'])})" for name in QUALITIES)
    said = f"Pixels of `{PICTURED}` in linear light, from left to right: {figures}."
    return f"![Four times the same part of a spacecraft](../images/qualities.jpg)\n\n{prose(said)}"


def _references(folder: Path) -> str:
    """Return how far off the references themselves are, by stage."""
    found = measurements(folder)
    frames = [frame for each in found.values() for frame in each.frames]
    most = " (as many as were allowed)" if any(frame.reference_capped for frame in frames) else ""
    off = [
        f"{' and '.join(percent(frame.reference_error) for frame in each.frames)} on `{stage}`"
        for stage, each in found.items()
    ]
    samples = max(frame.reference_samples for frame in frames)
    return (
        f"The errors are against references of up to {samples:,} samples{most}, which are themselves off by "
        f"{', '.join(off)}."
    )


def _cell(outcome: Outcome | None) -> str:
    if outcome is None:
        return "not measured"
    return f"{number(outcome.cpu_s)} s · {percent(outcome.error(Criterion.LIGHT).expected)}"


def _chosen(named: dict[str, Outcome | None], found: Measurement) -> str:
    auto, plain = named[AUTOMATIC], named[ASKED_PLAIN]
    if plain is None:
        return "not measured"
    if auto is None:
        return _nearest(found)
    totals = [number((error**2 + noise**2) ** 0.5) for error, noise in (auto.in_image, plain.in_image)]
    return f"`{auto.setting.text}` · {percent(auto.cpu_s / plain.cpu_s)} · {totals[0]} beside {totals[1]}"


def _nearest(found: Measurement) -> str:
    """Return what the most exact setting reaches, where none is as exact as the detector."""
    nearest = most_exact(found)
    if nearest is None:
        return "the detector has no noise"
    error = nearest.error(Criterion.IMAGE)
    times = within(error.expected, error.at_most - error.expected)
    return f"none: the most exact, `{nearest.setting.text}`, is off by {times} times the detector's noise"


def reports(folder: Path) -> dict[str, str]:
    """Return all that was measured of each stage, by the name of a file beside its JSON."""
    plot = "![Error against CPU seconds](../../docs/images/measure_{0}.svg)\n"
    found = measurements(folder).items()
    return {f"measure_{name}.md": f"{in_full(each)}\n{plot.format(name)}" for name, each in found}
