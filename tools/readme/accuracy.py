"""Blocks made of tools/figures/measure_NAME.json of the three stages, which `tools/bench stages` writes."""

from collections.abc import Iterator
from pathlib import Path
from statistics import median

from readme.marked import NotMeasuredError, prose
from three_stages import STAGES

from spin_usd.dataset.measure.file import read_measurement
from spin_usd.measuring.front import Outcome
from spin_usd.measuring.measurement import Measurement, Saving
from spin_usd.measuring.report import in_full
from spin_usd.measuring.summary import PLAIN, by_name
from spin_usd.measuring.tables import in_markdown, number, percent

AUTO = "--error auto"


def measurements(folder: Path) -> dict[str, Measurement]:
    files = {name: folder / f"measure_{name}.json" for name in STAGES}
    if lacking := [name for name, file in files.items() if not file.is_file()]:
        raise NotMeasuredError(f"run tools/bench stages --stages {' '.join(lacking)}")
    return {name: read_measurement(file) for name, file in files.items()}


def qualities(folder: Path) -> str:
    """What the named qualities, so many plain samples, and `--error auto` come to on each stage."""
    named = {stage: dict(by_name(found)) for stage, found in measurements(folder).items()}
    asked = next(iter(named.values()))
    rows = [[f"`{name}`", *(_cell(of[name]) for of in named.values())] for name in asked if name != AUTO]
    rows.append([f"`{AUTO}`", *(_chosen(of) for of in named.values())])
    note = (
        "CPU seconds a picture · relative error in linear light, of the worst picture measured; "
        f"for `{AUTO}` what it chose · its share of the time of `{PLAIN.text}` · the image's error with the "
        "detector's noise in it, digital numbers, beside that one's:"
    )
    plot = "![Error against CPU seconds on the stage sunlamp](.github/measure_sunlamp.svg)"
    tables = ", ".join(f"[{stage}](tools/figures/measure_{stage}.md)" for stage in named)
    return f"{prose(note)}\n\n{in_markdown(('', *named), rows)}\n{plot}\n\n{prose(f'All settings: {tables}.')}"


def _cell(outcome: Outcome | None) -> str:
    return f"{number(outcome.cpu_s)} s · {percent(outcome.worst.error)}" if outcome else "not measured"


def _chosen(named: dict[str, Outcome | None]) -> str:
    auto, plain = named[AUTO], named[f"--samples {PLAIN.samples}"]
    if auto is None or plain is None:
        return "nothing is good enough"
    totals = [number((error**2 + noise**2) ** 0.5) for error, noise in (auto.in_image, plain.in_image)]
    return f"`{auto.setting.text}` · {percent(auto.cpu_s / plain.cpu_s)} · {totals[0]} beside {totals[1]}"


def savings(folder: Path) -> str:
    """What each stage did not need, how much of a render's time that saves, and what it changes."""
    rows = [row for stage, found in measurements(folder).items() for row in _saved(stage, found.savings)]
    headings = ("stage", "left out", "CPU time saved", "relative difference", "another seed's")
    return f"What those stages do not need is not done:\n\n{in_markdown(headings, rows)}"


def _saved(stage: str, of_stage: tuple[Saving, ...]) -> Iterator[list[str]]:
    for what in dict.fromkeys(each.what for each in of_stage):
        every = [each for each in of_stage if each.what == what]
        share = median(1 - each.cpu_s / each.cpu_s_with for each in every)
        worst = max(every, key=lambda each: each.difference)
        saved = percent(share) if all(each.told for each in every) else "too small to tell"
        yield [stage, what, saved, percent(worst.difference), percent(worst.noise)]


def reports(folder: Path) -> dict[str, str]:
    """Of each stage all that was measured, by the name of a file beside its JSON."""
    plot = "![Error against CPU seconds](../../.github/measure_{0}.svg)\n"
    found = measurements(folder).items()
    return {f"measure_{name}.md": f"{in_full(each)}\n{plot.format(name)}" for name, each in found}
