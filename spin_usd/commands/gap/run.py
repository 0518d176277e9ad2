"""Compare real pictures with pictures of a stage, measure by measure, and fit light, camera and surface."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
from msgspec import structs

from spin_usd.commands.gap.calls import (
    FIT_LIGHT,
    MEASURE_PAIR,
    OPEN_GAP,
    FitLight,
    Fitted,
    LightAnswer,
    MeasuredPair,
    MeasurePair,
    OpenedGap,
    OpenGap,
    Pair,
)
from spin_usd.commands.gap.options import GapOptions
from spin_usd.commands.gap.real_pictures import pairs_in
from spin_usd.commands.gap.report import GapFit, GapReport
from spin_usd.commands.gap.summary import Step, camera_parameters, report_of
from spin_usd.errors import RenderError, SpinError
from spin_usd.files.folder import Folder
from spin_usd.options import PictureOptions, takes
from spin_usd.planning.request import RenderRequest
from spin_usd.processes.call import Answer, Call, Request
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import RENDER_PATIENCE_S, rendering_memory
from spin_usd.processes.executor import Executor
from spin_usd.processes.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.processes.processors import share_of, usable_cpus
from spin_usd.processes.task import Task
from spin_usd.realism.camera_fit import fit_camera
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import CPU
from spin_usd.store.atomic import write_text
from spin_usd.store.hidden_folder import hidden_folder

DRAFT = "draft"  # a fit and the measures need no better light


@takes(GapOptions)
def gap(options: GapOptions) -> GapReport:
    """Compare a folder of real pictures with a stage of the same poses: black level, noise, sharpness, light on the
    target and on each part, silhouettes, and how well a classifier tells them apart; and fit light, camera and surface.

    The fits are layers over a copy of the stage, which `spin-usd render` renders; the stage itself never changes.

    Raises InputError, StageError, OutputError, and RenderError if no picture could be compared.
    """
    request = _request(options)
    settings = RenderSettings(
        renderer=request.renderer, effort=request.effort, seed=options.seed or 0, device=request.devices()[0]
    )
    workers = options.workers or len(usable_cpus())

    def start(number: int) -> Child:
        child = Child(memory=rendering_memory(), modules=(OPEN_GAP.module,))
        cpus = share_of(number, workers)
        child.send(OPEN_GAP, OpenGap(stage=str(request.stage), variant=options.variant, settings=settings, cpus=cpus))
        return child

    with Executor[OpenedGap](start, workers=workers, opening=OPEN_GAP) as executor:
        opened = executor.opened_content()
        poses = None if options.poses is None else Path(options.poses)
        pairs, notes = pairs_in(Path(options.real), poses, opened.frames)
        comparison = Comparison(options=options, executor=executor, pairs={pair.name: pair for pair in pairs})
        comparison.measure("ours")
        for name in options.fits:
            FITTING[name](comparison)
            comparison.measure(name)
    report = report_of(options, comparison.steps, comparison.fits, comparison.left_out, notes)
    _write(Path(options.out), report, comparison.steps)
    return report


def _write(out: Path, report: GapReport, steps: Sequence[Step]) -> None:
    """Write gap.json and index.html into the folder `out`. Raises OutputError."""
    from spin_usd.commands.gap.page import page_of  # not above: matplotlib is slow to load

    measured = msgspec.json.format(msgspec.json.encode(report), indent=1).decode() + "\n"
    with hidden_folder(out.parent, out.name) as hidden:
        for name, text in (("gap.json", measured), ("index.html", page_of(report, steps))):
            write_text(Folder(out), name, text, work=hidden.folder)


def _request(options: GapOptions) -> RenderRequest:
    """Return the request for our pictures. Raises InputError."""
    given = {name: getattr(options, name) for name in ("samples", "effort", "quality")}
    if options.renderer in (None, "blender") and all(each is None for each in given.values()):
        given["quality"] = DRAFT
    request = RenderRequest.of(
        PictureOptions(stage=options.stage, variants=options.variant, renderer=options.renderer, device=CPU, **given)
    )
    require_renderer(request.renderer, instead=ANOTHER_RENDERER)
    return request


@dataclass(kw_only=True)
class Comparison:
    """A running comparison."""

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
            for name in step.pictures.keys() - found.keys():
                del step.pictures[name]
        return found


def _fit_light(comparison: Comparison) -> None:
    """Fit the light of each picture."""
    start, panels = time.monotonic(), comparison.options.panels
    requests = {
        name: FitLight(pair=pair, fitted=structs.replace(comparison.of(name), panels=panels, lights=None))
        for name, pair in comparison.pairs.items()
    }
    comparison.lights = comparison.each(FIT_LIGHT, requests, "fitting the light: picture")
    for name, answer in comparison.lights.items():
        shining = {light.path: light.strength for light in answer.lights}
        comparison.fitted[name] = structs.replace(comparison.of(name), panels=panels, lights=shining)
    explained = sorted(answer.explained for answer in comparison.lights.values())
    seconds = (time.monotonic() - start) / len(requests)
    comparison.fits["light"] = GapFit(parameters={}, explained=explained[len(explained) // 2], seconds=seconds)


def _fit_camera(comparison: Comparison) -> None:
    """Fit the camera of all pictures, and the black level of each."""
    start, last = time.monotonic(), _sharp(comparison.steps)
    pictures = list(comparison.steps[0].pictures.values())
    nan = float("nan")
    camera = fit_camera(
        [each.linear.get("noise", nan) for each in pictures],
        [each.linear.get("shot_noise", nan) for each in pictures],
        [nan if each.psf_sigma is None else each.psf_sigma for each in last.values()],
    )
    for name, each in comparison.steps[0].pictures.items():
        comparison.fitted[name] = structs.replace(comparison.of(name), camera=camera, level=each.linear["level"])
    seconds = (time.monotonic() - start) / len(pictures)
    levels = [each.linear["level"] for each in pictures]
    comparison.fits["camera"] = GapFit(parameters=camera_parameters(camera, levels), seconds=seconds)


def _sharp(steps: Sequence[Step]) -> Mapping[str, MeasuredPair]:
    """Return the pictures of the last step in which the edges were measured."""
    return next(step.pictures for step in reversed(steps) if step.name in ("light", "ours"))


FITTING: Mapping[str, Callable[[Comparison], None]] = {"light": _fit_light, "camera": _fit_camera}
