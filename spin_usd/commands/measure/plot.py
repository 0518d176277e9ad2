"""A measurement as a plot: cost and error of settings, in linear light and after the detector.

SVG with its text as text, the same to the byte from the same numbers.
"""

import re
from collections.abc import Container, Sequence
from dataclasses import replace
from io import StringIO
from typing import Any

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from spin_usd.accuracy.choice import AUTO
from spin_usd.accuracy.front import Criterion, Outcome, front, outcomes
from spin_usd.accuracy.measurement import Configuration, Measurement
from spin_usd.scene.effort import QUALITIES, Effort

SIZE_INCHES = (10.5, 4.2)
INK, GREY, PALE = "#222222", "#888888", "#c4c4c4"
BELOW_LEFT: dict[str, Any] = {
    "xytext": (-5, -3),
    "textcoords": "offset points",
    "ha": "right",
    "va": "top",
    "size": 6.5,
    "color": INK,
}
ROOM = (0.12, 0.03)  # of a name, as a share of the panel
MAX_SPREAD = 10  # largest ratio between the ends of a line
LOOKS = {  # by kind of setting: marker and colour, distinct for colour-blind people (Okabe and Ito)
    "plain samples": ("o", "#0072b2"),
    "denoised": ("s", "#d55e00"),
    "adaptive": ("^", "#009e73"),
    "others": ("D", "#cc79a7"),
    "raycast": ("v", "#56b4e9"),
}


def plot(measurement: Measurement) -> str:
    """Return the text of an SVG file: error against CPU seconds, all settings, the front and the named qualities."""
    found = outcomes(measurement)
    text = StringIO()
    style: dict[Any, Any] = {
        "svg.fonttype": "none",
        "svg.hashsalt": "spin_usd",
        "font.sans-serif": ["DejaVu Sans"],
        "font.size": 8,
    }
    with matplotlib.style.context(["default", style]):  # whatever the user's own matplotlibrc contains
        figure = Figure(figsize=SIZE_INCHES, facecolor="white", layout="constrained")
        FigureCanvasSVG(figure)
        light, image = figure.subplots(1, 2)
        _panel(light, found, Criterion.LIGHT, "error in linear light, at most, worst picture")
        light.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
        light.legend(loc="upper right", frameon=False)
        _panel(image, found, Criterion.IMAGE, "error after the detector over its own noise, at most, worst picture")
        _detector(image, [frame.noise_dn for frame in measurement.frames])
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"\n +", "\n", _short_coordinates(text.getvalue()))


def _short_coordinates(svg: str) -> str:
    """Shorten coordinates to hundredths of a point, which are enough; text between tags stays."""
    return re.sub(r">[^<]*<|(\.\d\d)\d+", lambda found: found[1] or found[0], svg)


def kind_of(setting: Configuration) -> str:
    """Return which of the kinds in LOOKS the setting is, whether it filters glossy surfaces or not."""
    usual, effort = Effort(samples=setting.effort.samples), replace(setting.effort, filter_glossy=0.0)
    if setting.renderer == "raycast":
        return "raycast"
    if effort.adaptive:
        return "adaptive"
    if effort == usual:
        return "plain samples"
    return "denoised" if effort.text == f"{usual.text},denoiser={effort.denoiser}" else "others"


def _panel(axes: Axes, found: Sequence[Outcome], criterion: Criterion, title: str) -> None:
    most = {each: each.error(criterion).at_most for each in found}
    shown = [each for each in found if 0 < most[each] < float("inf")]
    best = front(shown, criterion)
    axes.set_title(title, fontsize=9, loc="left")
    axes.set_xlabel("CPU seconds a picture, mean of the pictures")
    _scales(axes)
    _lines(axes, best, criterion)
    for kind, (marker, colour) in LOOKS.items():
        of_kind = [(each.cpu_s, most[each]) for each in shown if kind_of(each.setting) == kind]
        if of_kind:
            axes.plot(*zip(*of_kind, strict=True), marker, markersize=3.8, color=colour, label=kind)
    _names(axes, [(each.setting, (each.cpu_s, most[each])) for each in shown], {each.setting for each in best})


def _lines(axes: Axes, best: Sequence[Outcome], criterion: Criterion) -> None:
    """Draw the front, and a line from each of its points down to the expected error of the picture with the least
    error."""
    x, most = [each.cpu_s for each in best], [each.error(criterion).at_most for each in best]
    least = [min(error.expected for error in each.errors(criterion)) for each in best]
    axes.plot(x, most, color=GREY, linewidth=1, zorder=1)
    ends = [(high, max(low, high / MAX_SPREAD), float("nan")) for high, low in zip(most, least, strict=True)]
    down = [y for points in ends for y in points]
    axes.plot([each for each in x for _ in range(3)], down, color=PALE, linewidth=0.6, zorder=1)


def _scales(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(0.14)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_locator(NullLocator())
        axis.set_tick_params(length=0)
    axes.grid(color="#e6e6e6", linewidth=0.5)


def _names(
    axes: Axes, points: Sequence[tuple[Configuration, tuple[float, float]]], best: Container[Configuration]
) -> None:
    """Write the names of the named qualities, and of the front's other points that have room."""
    qualities = {Configuration(renderer="blender", effort=effort): f"{name}: " for name, effort in QUALITIES.items()}
    axes.autoscale_view()
    place = (axes.transData - axes.transAxes).transform
    taken: list[tuple[float, float]] = []
    for setting, at in sorted(points, key=lambda point: point[0] not in qualities):
        quality, (x, y) = qualities.get(setting, ""), place(at)
        if quality:
            axes.plot(*at, "o", markersize=8, markerfacecolor="none", markeredgecolor=INK, zorder=3)
        elif setting not in best or any(abs(x - a) < ROOM[0] and abs(y - b) < ROOM[1] for a, b in taken):
            continue
        weight = "bold" if quality else "normal"
        axes.annotate(quality + _short(setting), at, weight=weight, **BELOW_LEFT)  # where a front has no points
        taken.append((x, y))


def _short(setting: Configuration) -> str:
    """Return the setting's text without the values that all settings share: `16 fast`."""
    label = (
        setting.effort.text.removeprefix("samples=")
        .replace("denoiser=", "")
        .replace("filter_glossy=", "filter ")
        .replace(",", " ")
    )
    return label if setting.renderer == "blender" else f"{setting.renderer} {label}"


def _detector(axes: Axes, noise_dn: Sequence[float]) -> None:
    """Shade where the error is less than AUTO of the noise: there, higher cost brings nothing."""
    low, high = axes.get_ylim()
    low = min(low, AUTO / 2)
    axes.set_ylim(low, high)
    axes.axhspan(low, AUTO, color="#eef3ea", zorder=0)
    dn = " to ".join(dict.fromkeys(f"{AUTO * each:.2g}" for each in (min(noise_dn), max(noise_dn))))
    note, corner = f"shaded: at most the detector's noise, {dn} DN", {"ha": "left", "va": "bottom"}
    axes.annotate(note, (0, 0), xycoords="axes fraction", **(BELOW_LEFT | corner | {"xytext": (5, 4)}))
