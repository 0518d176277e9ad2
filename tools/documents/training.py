"""Blocks and plots of what networks learned from, of tools/figures/training, which tools/train/experiment writes."""

import json
import statistics
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import matplotlib.style
from documents.marked import NotMeasuredError, prose
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from spin_usd.accuracy.tables import in_markdown, number, within

SCORE = "speedplus"
SEGMENTS = ("mean", "main_body", "solar_panel", "payload")
"""Classes of parts that a table has, of the seven that the mean is over."""
BED = "lightbox"  # the test of real pictures
MEANING = {
    "plain": "one colour a material, no shadows, an ideal detector; the Sun moves",
    "c": "of a rich camera: blur, glare, noise, limits of the exposure",
    "e": "in a rich environment: shadows, the Earth behind and its light",
    "m": "of rich materials: glass, foil, metal",
    "ce": "camera and environment",
    "cm": "camera and materials",
    "em": "environment and materials",
    "rich": "camera, environment and materials are rich; the Sun moves",
    "rich_1": "rich; light, materials and background differ from pose to pose",
    "rich_3": "the same, three appearances of each pose",
    "rich_10": "the same, ten appearances of each pose",
    "rich_1_750": "`rich_1` for fewer steps",
    "rich_1_1500": "`rich_1` for fewer steps",
    "lightbox": "the preset and the augmentation `lightbox`, look `mockup`",
    "lightbox_earth": "the same likeness, with an Earth behind half of the pictures",
    "lightbox_long": "the same, made anew since, for more steps",
    "mixed": "every other picture of `rich_1` and of `lightbox`",
    "grey": "one matt grey for all; camera and environment are rich, the Sun moves, in all rows",
    "colors": "the flat, matt colours that it was modelled in",
    "auto": "materials of the library, as `--materials auto` recognises them",
    "auto_1": "the same, of another appearance from pose to pose",
    "auto_3": "the same, three appearances of each pose",
    "drawn": "Tango as drawn",
    "bent": "its panel and antennas off their places, in each picture otherwise",
    "bundled": "the four bundled targets",
    "seeds_1": "one craft from a seed",
    "seeds_10": "ten",
    "seeds_100": "a hundred",
    "seeds_1000": "a thousand",
}


@dataclass(frozen=True, kw_only=True)
class Row:
    """Runs of one row, one for each seed, as the experiment keeps them."""

    name: str
    runs: Sequence[Mapping[str, Any]]

    def cpu_s(self, kind: str) -> float:
        """Return the processor seconds of "render" or "train", the mean over runs."""
        return statistics.fmean(run[f"{kind}_cpu_s"] for run in self.runs)

    def score(self, test: str) -> tuple[float, float]:
        """Return the mean score on a test over the seeds, and its standard error; that is NaN of one seed."""
        return _mean([_score(run, test) for run in self.runs])

    def degrees(self, test: str) -> tuple[float, float]:
        """Return the same of the median error of the attitude, degrees."""
        return _mean([_degrees(run, test) for run in self.runs])


def _score(run: Mapping[str, Any], test: str) -> float:
    found: float = run["scores"][test]["scores"][SCORE]
    return found


def _degrees(run: Mapping[str, Any], test: str) -> float:
    found: float = run["scores"][test]["attitude_deg"]["median"]
    return found


def _mean(values: Sequence[float]) -> tuple[float, float]:
    error = statistics.stdev(values) / len(values) ** 0.5 if len(values) > 1 else float("nan")
    return statistics.fmean(values), error


def rows_of(folder: Path, experiment: str) -> list[Row]:
    """Return the rows that are finished, from the cheapest to render on. Raises NotMeasuredError for none."""
    runs = defaultdict(list)
    for file in sorted((folder / "training" / experiment).glob("*.json")):
        run = json.loads(file.read_text())
        runs[run["row"]].append(run)
    if not runs:
        raise NotMeasuredError(f"run tools/train/experiment tools/train/experiments/{experiment}.toml")
    return sorted((Row(name=name, runs=found) for name, found in runs.items()), key=lambda row: row.cpu_s("render"))


def proxy(folder: Path) -> str:
    """Return what richness and appearances are worth."""
    return _table(rows_of(folder, "proxy"))


def cost(folder: Path) -> str:
    """Return what the quality of the training pictures is worth, with its plot."""
    table = _table(rows_of(folder, "cost"))
    return f"{table}\n![Error on held-out sets against processor seconds of rendering](../images/training_cost.svg)"


def groups(folder: Path) -> str:
    """Return what each of camera, environment and materials is worth."""
    ends = [row for row in rows_of(folder, "proxy") if row.name in ("plain", "rich")]
    return _table([*rows_of(folder, "groups"), *ends])


def poses(folder: Path) -> str:
    """Return what the number of poses is worth."""
    return _table(rows_of(folder, "poses"))


def looks(folder: Path) -> str:
    """Return what materials of the library are worth on a craft that is not Tango."""
    return _table(rows_of(folder, "looks"))


def shapes(folder: Path) -> str:
    """Return what shapes that are not quite as drawn are worth, and cost a network."""
    return _table(rows_of(folder, "shapes"))


def segments(folder: Path) -> str:
    """Return what many craft are worth to a network that finds parts of others: intersections over unions."""
    rows = _ordered(rows_of(folder, "segments"))
    first = rows[0].runs[0]
    headings, cells = ["learned from"], [[_named(row.name)] for row in rows]
    for test in first["scores"]:
        headings += [f"{test}: {name.replace('_', ' ')}" for name in SEGMENTS]
        for row, made in zip(rows, cells, strict=True):
            made += [_iou(row, test, name) for name in SEGMENTS]
    training = first["training"]
    craft = ", ".join(f"{test}: {each['craft']}" for test, each in first["scores"].items())
    note = (
        f"Intersection over union, percent, of all seven classes and of three: mean of {len(rows[0].runs)} seeds "
        f"with its standard error; in brackets the 95 % interval over craft ({craft}), by bootstrap. "
        f"{first['pictures']} pictures or a little fewer, {training['steps']} steps of {training['batch']} crops of "
        f"{training['size']} pixels. {_state(rows)}"
    )
    return f"{prose(note)}\n\n{in_markdown(headings, cells)}"


def _iou(row: Row, test: str, name: str) -> str:
    found = [run["scores"][test] for run in row.runs]
    value, error = _mean([100 * each["iou"][name] for each in found])
    low, high = (100 * statistics.fmean(each["interval_95"][name][end] for each in found) for end in (0, 1))
    return f"{_within((value, error))} ({number(low)} to {number(high)})"


def real(folder: Path, experiment: str = "real") -> str:
    """Return scores on real pictures with intervals over them, each run for itself, beside those on synthetic sets."""
    rows = _ordered(rows_of(folder, experiment))
    runs = [run for row in rows for run in row.runs]
    tests = [test for test in runs[0]["scores"] if test != BED]
    cells = [
        [
            _named(run["row"]),
            *(str(run["training"][name]) for name in ("seed", "steps")),
            number(run["loss"]),
            _interval(run, _score(run, BED), SCORE),
            _interval(run, _degrees(run, BED), "attitude_deg_median") + "°",
            *(f"{number(_score(run, test))} · {number(_degrees(run, test))}°" for test in tests),
        ]
        for run in runs
    ]
    training, counts = runs[0]["training"], sorted({run["pictures"] for run in runs})
    note = (
        f"SPEED+ score · median error of the attitude; of the {runs[0]['scores'][BED]['pictures']} real pictures with "
        f"95 % intervals, by bootstrap over the pictures. {' or '.join(map(str, counts))} pictures to learn from, in "
        f"crops of {training['size']} pixels, {training['batch']} a step. {_state(rows)}"
    )
    headings = ("learned from", "seed", "steps", "loss", "real: score", "real: attitude", *tests)
    return f"{prose(note)}\n\n{in_markdown(headings, cells)}"


def _interval(run: Mapping[str, Any], value: float, name: str) -> str:
    low, high = run["scores"][BED]["interval_95"][name]
    return f"{number(value)} ({number(low)} to {number(high)})"


def _ordered(rows: Sequence[Row]) -> list[Row]:
    places = {name: place for place, name in enumerate(MEANING)}
    return sorted(rows, key=lambda row: places.get(row.name, 0))


def _named(row: str) -> str:
    return f"`{row}`" + (f": {MEANING[row]}" if row in MEANING else "")


def _table(rows: Sequence[Row]) -> str:
    tests = list(rows[0].runs[0]["scores"])
    cells = [
        [
            _named(row.name),
            str(row.runs[0]["pictures"]),
            number(row.cpu_s("render")),
            *(f"{_within(row.score(test))} · {_within(row.degrees(test))}°" for test in tests),
        ]
        for row in _ordered(rows)
    ]
    seeds = {len(row.runs) for row in rows}
    training = rows[0].runs[0]["training"]
    train = statistics.fmean(row.cpu_s("train") for row in rows)
    devices = sorted({run.get("device", "cpu") for row in rows for run in row.runs} - {"cpu"})
    note = (
        f"SPEED+ score · median error of the attitude; means over {' or '.join(map(str, sorted(seeds)))} seeds with "
        f"their standard errors. {training['steps']} steps of {training['batch']} crops of {training['size']} pixels, "
        f"{train:.0f} processor seconds{''.join(f' beside an {device}' for device in devices)}; rendering: processor "
        f"seconds of all the row's pictures. {_state(rows)}"
    )
    return f"{prose(note)}\n\n{in_markdown(('learned from', 'pictures', 'rendering, s', *tests), cells)}"


def _state(rows: Sequence[Row]) -> str:
    """Return the state of spin_usd that the rows are of. Ends the program for a table of several: what was rendered and
    learned by one is no more comparable with another's."""
    runs = [run for row in rows for run in row.runs]
    commits = {run.get("commit") for run in runs}
    if len(commits) > 1:
        found = ", ".join(sorted(f"{run['row']} of {run.get('commit', 'no commit')}" for run in runs))
        raise SystemExit(f"rows of one table are of several states of spin_usd: {found}; take them again")
    days = sorted({run["finished"] for run in runs})
    return f"Commit {commits.pop() or 'unknown'}, {' to '.join(dict.fromkeys((days[0], days[-1])))}."


def _within(found: tuple[float, float]) -> str:
    value, error = found
    return within(value, error) if error == error else number(value)


def throughput(folder: Path) -> str:
    """Return how fast pictures come to a training step."""
    file = folder / "training" / "throughput.json"
    if not file.is_file():
        raise NotMeasuredError("run tools/train/throughput DATASET... --json tools/figures/training/throughput.json")
    found = json.loads(file.read_text())
    cells = []
    for one in found["sets"]:
        pixels, rates = "x".join(map(str, one["pixels"])), one["rates"]
        for name, rate in rates.items():
            alone, trained = (rate["read"], rate["trained"]) if isinstance(rate, dict) else ((), (rate,))
            cells.append([f"{pixels}, {name}", *(" · ".join(number(each) for each in of) for of in (alone, trained))])
    training = found["training"]
    note = (
        f"Pictures a second on {found['machine']['cores']} processor cores, one of which trains, with 0 · 1 · 2 "
        f"processes that make batches of {training['batch']} crops of {training['size']} pixels with their heatmaps."
    )
    return f"{prose(note)}\n\n{in_markdown(('from', 'reading alone', 'training too'), cells)}"


def cost_plot(folder: Path) -> str:
    """Return the text of an SVG file: the score on each held-out set against processor seconds of rendering, the front
    of those that nothing cheaper beats, of both experiments."""
    rows = [*rows_of(folder, "cost"), *(row for row in rows_of(folder, "proxy") if row.name not in ("plain", "rich"))]
    tests = list(rows[0].runs[0]["scores"])
    rows.sort(key=lambda row: row.cpu_s("render"))
    text = StringIO()
    style: dict[Any, Any] = {"svg.fonttype": "none", "svg.hashsalt": "spin_usd", "font.size": 8}
    with matplotlib.style.context(["default", style]):
        figure = Figure(figsize=(9.5, 3.6), facecolor="white", layout="constrained")
        FigureCanvasSVG(figure)
        for axes, test in zip(figure.subplots(1, len(tests)), tests, strict=True):
            x, y = [row.cpu_s("render") for row in rows], [row.score(test) for row in rows]
            axes.errorbar(x, [mean for mean, _ in y], [error for _, error in y], fmt="o", markersize=4, color="#0072b2")
            front = [place for place in range(len(y)) if all(y[place][0] < y[other][0] for other in range(place))]
            axes.plot([x[place] for place in front], [y[place][0] for place in front], color="#888888", linewidth=1)
            for row, at, (mean, _) in zip(rows, x, y, strict=True):
                axes.annotate(row.name, (at, mean), xytext=(5, 4), textcoords="offset points", size=7)
            axes.set_xscale("log")
            axes.set_title(f"SPEED+ score on {test}, mean and standard error", fontsize=9, loc="left")
            axes.set_xlabel("processor seconds of rendering, all pictures")
            axes.margins(0.15)
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return "\n".join(line.strip() for line in text.getvalue().splitlines()) + "\n"
