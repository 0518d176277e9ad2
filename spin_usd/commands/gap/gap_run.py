"""A run of `gap`: steps of measures over all pairs, and the fits between them."""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

import numpy as np
from msgspec import UNSET, structs

from spin_usd.basics.arrays import Float
from spin_usd.commands.gap.calls import (
    FIT_LIGHT,
    MEASURE_PAIR,
    SHOWN_MATERIALS,
    TRY_SURFACES,
    FitLight,
    Fitted,
    LightAnswer,
    MeasuredPair,
    MeasurePair,
    OpenedGap,
    Pair,
    TrySurfaces,
)
from spin_usd.commands.gap.options import GapOptions
from spin_usd.commands.gap.report import GapFit, GapParameter
from spin_usd.commands.gap.summary import Step, camera_parameters
from spin_usd.errors import RenderError, SpinError
from spin_usd.processes.call import Answer, Call, Request
from spin_usd.processes.child_limits import RENDER_PATIENCE_S
from spin_usd.processes.executor import Executor
from spin_usd.processes.task import Task
from spin_usd.realism.camera_fit import before_jpeg, fit_camera
from spin_usd.realism.intervals import LEAST, Interval, median_interval
from spin_usd.realism.surface_fit import SHARES, STEPS, Surfaces

NOISE = ("black_level", "noise", "noise_across", "noise_down", "shot_noise")
BITS = 8  # of a sensor that can compress
MATERIALS = 6  # that most of the target's pixels show
LEAST_SHOWN = 0.03  # of these pixels
SURFACE_PICTURES = 12  # about, evenly from the list: surfaces are the same in all


@dataclass(kw_only=True)
class GapRun:
    """A run: steps of measures, and fits."""

    options: GapOptions
    executor: Executor[OpenedGap]
    pairs: dict[str, Pair]
    """Pairs by name; one that fails is removed."""
    fitted: dict[str, Fitted] = field(default_factory=dict)
    """Fits so far of each picture."""
    steps: list[Step] = field(default_factory=list)
    fits: dict[str, GapFit] = field(default_factory=dict)
    lights: dict[str, LightAnswer] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)

    def measure(self, name: str) -> None:
        """Measure all pairs with the fits so far, as a step of that name."""
        start, first = time.monotonic(), not self.steps
        requests = {
            pair.name: MeasurePair(pair=pair, fitted=self.of(pair.name), sharpness=first or name == "light")
            for pair in self.pairs.values()
        }
        found = self.each(MEASURE_PAIR, requests, f"measuring ({name}): picture")
        seconds = (time.monotonic() - start) / max(len(requests), 1)
        self.steps.append(Step(name=name, pictures=found, lights=dict(self.lights), seconds=seconds))

    def try_surfaces(self, names: Sequence[str], trials: list[dict[str, float]], what: str) -> Float:
        """Return (pictures, trials, trials) the products of the residuals of trials of materials."""
        requests = {
            name: TrySurfaces(pair=self.pairs[name], fitted=self.of(name), psf_sigma=self.psf_sigma, trials=trials)
            for name in names
        }
        found = self.each(TRY_SURFACES, requests, what)
        return np.array([found[name].products for name in names])

    @property
    def psf_sigma(self) -> float | None:
        """Point spread function of the real pictures as last measured, pixels; None where it was not found."""
        found = [each.psf_sigma for each in _sharp(self.steps).values() if each.psf_sigma is not None]
        return float(np.median(found)) if len(found) >= LEAST else None

    def of(self, name: str) -> Fitted:
        """Return the fits so far of a picture."""
        return self.fitted.get(name, Fitted())

    def each(self, call: Call[Request, Answer], requests: Mapping[str, Request], what: str) -> dict[str, Answer]:
        """Return the answers to a call by picture. A picture that fails is left out from now on; raises RenderError if
        all do."""
        tasks = [Task(call=call, request=each, within_s=RENDER_PATIENCE_S) for each in requests.values()]
        found: dict[str, Answer] = {}
        for done, (name, task) in enumerate(zip(requests, self.executor.in_order(tasks), strict=True), 1):
            if isinstance(task.failure, SpinError):
                self.left_out[name] = str(task.failure)
                self.pairs.pop(name, None)
            else:
                found[name] = task.result
            self.options.progress(what, done, len(requests))
        if not found:
            raise RenderError(
                f"no picture could be compared: {next(iter(self.left_out.values()))}",
                where=self.options.real,
                do="compare pictures of the stage's size that show its target",
            )
        for step in self.steps:
            for name in step.pictures.keys() & self.left_out.keys():
                del step.pictures[name]
        return found


def _fit_light(run: GapRun) -> None:
    """Fit the light of each picture."""
    start, panels = time.monotonic(), run.options.panels
    requests = {
        name: FitLight(
            pair=pair,
            fitted=structs.replace(run.of(name), panels=panels, lights=None),
            psf_sigma=run.psf_sigma,
        )
        for name, pair in run.pairs.items()
    }
    run.lights = run.each(FIT_LIGHT, requests, "fitting the light: picture")
    for name, answer in run.lights.items():
        shining = {light.path: light.strength for light in answer.lights}
        run.fitted[name] = structs.replace(run.of(name), panels=panels, lights=shining)
    explained = float(np.median([answer.explained for answer in run.lights.values()]))
    seconds = (time.monotonic() - start) / len(requests)
    run.fits["light"] = GapFit(parameters={}, explained=explained, seconds=seconds)


def _fit_camera(run: GapRun) -> None:
    """Fit the camera of all pictures, and the black level of each."""
    start, last = time.monotonic(), _sharp(run.steps)
    pictures = list(run.steps[0].pictures.values())
    nan = float("nan")
    camera = fit_camera(
        [each.linear.get("noise", nan) for each in pictures],
        [each.linear.get("shot_noise", nan) for each in pictures],
        [nan if each.psf_sigma is None else each.psf_sigma for each in last.values()],
    )
    if all(each.jpeg for each in pictures) and run.executor.opened_content().sensor.bit_depth == BITS:
        medians = {name: median_interval([each.real.get(name, nan) for each in pictures])[0] for name in NOISE}
        camera = before_jpeg(camera, medians)
    for name, each in run.steps[0].pictures.items():
        run.fitted[name] = structs.replace(run.of(name), camera=camera, level=each.linear["level"])
    seconds = (time.monotonic() - start) / len(pictures)
    levels = [each.linear["level"] for each in pictures]
    run.fits["camera"] = GapFit(parameters=camera_parameters(camera, levels), seconds=seconds)
    if "light" in run.fits:  # again, by the sharpness that was measured in the fitted light
        _fit_light(run)


def _sharp(steps: Sequence[Step]) -> Mapping[str, MeasuredPair]:
    """Return the pictures of the last step in which the edges were measured."""
    return next(step.pictures for step in reversed(steps) if step.name in ("light", "ours"))


def _fit_surface(run: GapRun) -> None:
    """Fit the materials that the pictures show most, over some of the pictures, and then the light of all again."""
    start, pixels, limits = time.monotonic(), Counter[str](), dict[str, dict[str, tuple[float, float]]]()
    for shown in run.each(SHOWN_MATERIALS, run.pairs, "finding materials: picture").values():
        pixels.update({name: material.pixels for name, material in shown.items()})
        limits |= {name: material.limits for name, material in shown.items()}
    enough = (name for name, count in pixels.most_common(MATERIALS) if count > LEAST_SHOWN * pixels.total())
    surfaces = Surfaces.starting({name: limits[name] for name in enough})
    names = list(run.pairs)[:: max(len(run.pairs) // SURFACE_PICTURES, 1)]
    intervals: list[Interval] = []
    for number, step in enumerate(STEPS, 1):
        what = f"fitting surfaces, round {number} of {len(STEPS)}: picture"
        products = run.try_surfaces(names, surfaces.trials(step), what)
        moved = surfaces.towards(products, step)
        along = [surfaces.values(surfaces.logs + share * moved) for share in SHARES]
        means = np.diagonal(run.try_surfaces(names, along, what).mean(0))
        best = int(means.argmin())
        if number == len(STEPS) and len(names) >= LEAST:
            intervals = surfaces.intervals(products, step)
        if means[best] < products[:, 0, 0].mean():
            surfaces = surfaces.moved(SHARES[best] * moved)
    for name in run.pairs:
        run.fitted[name] = structs.replace(run.of(name), values=surfaces.values(surfaces.logs))
    seconds = (time.monotonic() - start) / len(names)
    run.fits["surface"] = GapFit(
        parameters={
            name: GapParameter(value=value, interval=list(around) if around else UNSET, unit="factor")
            for (name, value), around in zip_longest(surfaces.values(surfaces.logs).items(), intervals)
        },
        seconds=seconds,
    )
    if "light" in run.options.fits:
        _fit_light(run)


FITTING: Mapping[str, Callable[[GapRun], None]] = {
    "light": _fit_light,
    "camera": _fit_camera,
    "surface": _fit_surface,
}
