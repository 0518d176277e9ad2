"""The child's part of a measurement: one renderer kept open, whose renders are timed and kept.

The time of each is stored with the most memory that this process held meanwhile.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import psutil

from spin_usd.accuracy.error import LabelImages, Viewpoint, agreement
from spin_usd.accuracy.measurement import LabelFigures, Saving
from spin_usd.basics.arrays import digest
from spin_usd.commands.measure.calls import (
    FindErrors,
    FindFigures,
    FindSavings,
    FoundErrors,
    FoundFigures,
    MakePairs,
    MakeRuns,
    OpenMeasuring,
    RenderOnce,
)
from spin_usd.commands.measure.figures import PictureFigures
from spin_usd.commands.measure.renders import RenderCost, RenderStore
from spin_usd.picture.make_picture import Stopwatch, make_labels
from spin_usd.processes.processors import hold_to
from spin_usd.renderers.renderer import LabelPass
from spin_usd.renderers.skipped import Requirements
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.studio.studio import Studio

RESET_PEAK = "5"  # proc(5), /proc/pid/clear_refs: reset the peak resident set size to the current one
PEAK = "VmHWM:"  # proc(5), /proc/pid/status: peak resident set size, kB


class MeasuringWorker:
    """A worker that lives in a child process, with a studio; `progress` is called with the key of each render as it is
    made."""

    def __init__(self, request: OpenMeasuring, progress: Callable[[str], None]) -> None:
        hold_to(request.cpus)
        self._runs = RenderStore(root=Path(request.folder), work=Path(request.work))
        self._reader = StageReader(request.stage, variant=request.variant)
        self._studio = Studio(RenderSettings(renderer=request.renderer, effort=Effort(), seed=0))
        self._crop, self._on_made = request.crop, progress
        self._studio.open_renderer(crop=self._crop)
        self._work: list[str] = []
        self._before: tuple[int, Effort] | None = None

    def make_runs(self, request: MakeRuns) -> None:
        """Render a picture with each of the seeds, keep each under its key, and report each."""
        self._do([])
        scene = self._scene(request.index)
        for key, seed in request.seeds.items():
            self._runs.keep(key, *self._timed(scene, request.effort, seed))
            self._on_made(key)

    def make_pairs(self, request: MakePairs) -> None:
        """Render a picture with each of the seeds with the work and without any, store each under its key, and report
        each. The two alternate, so that drifts affect both; and each is rendered twice, of which the second is kept, so
        that both are timed warm."""
        scene, pairs = self._scene(request.index), request.pairs
        for number, (seed, *keys) in enumerate(zip(request.seeds, pairs.with_it, pairs.without, strict=True)):
            turns = list(zip((request.work, []), keys, strict=True))
            for done, key in turns if number % 2 else reversed(turns):
                self._do(done)
                self._timed(scene, request.effort, seed)
                self._runs.keep(key, *self._timed(scene, request.effort, seed))
                self._on_made(key)

    def render_digest(self, request: RenderOnce) -> str:
        """Return the digest of a render, over every bit of it."""
        radiance = self._render(self._scene(request.index), request.effort, request.seed)
        return digest(radiance.groups, radiance.coverage)

    def labels(self, index: int) -> LabelFigures:
        """Compare the labels of picture `index`, of its first target alone, by this renderer's own label pass with the
        labels of datasets."""
        scene, own, usual = self._scene(index).one_body_scenes[0], self._studio.open_renderer(), self._studio.caster
        assert isinstance(own, LabelPass), f"{own.name} makes images alone"
        sight = Viewpoint(camera=scene.camera, T_cam_body=scene.T_cam_body)
        names = {"frame": scene.frame.name, "renderer": own.name, "against": usual.name}
        return agreement(_labels(scene, own), _labels(scene, usual), sight, **names)

    def errors(self, request: FindErrors) -> FoundErrors:
        """Return relative mean square errors: the reference's own, and of each setting's runs."""
        picture = self._picture(request.index, request.reference)
        settings = [picture.linear_error(keys).squared for keys in request.runs]
        return FoundErrors(reference=picture.reference.error_squared, settings=settings)

    def figures(self, request: FindFigures) -> FoundFigures:
        """Return the figures of each setting's runs."""
        picture = self._picture(request.index, request.reference)
        image = picture.developed(request.seed)
        figures = [
            picture.figures(image, setting, keys, capped=request.capped)
            for setting, keys in zip(request.settings, request.runs, strict=True)
        ]
        measured = picture.measured(image, samples=request.reference_samples, capped=request.capped)
        return FoundFigures(picture=measured, figures=figures)

    def skipped_work(self, request: RenderOnce) -> list[str]:
        """Return the names of the work that a render does not need."""
        required = Requirements.of(self._scene(request.index), request.effort)
        return [each.what for each in required.skipped]

    def savings(self, request: FindSavings) -> list[Saving]:
        """Return the savings and changes by leaving work out."""
        picture = self._picture(request.index, request.reference)
        return [picture.saving(work, runs.with_it, runs.without) for work, runs in request.runs.items()]

    def _do(self, work: list[str]) -> None:
        """Do that work in each later render, needed or not."""
        if work != self._work:
            self._studio.close()
            self._studio.open_renderer(crop=self._crop, keep=work)
            self._work, self._before = work, None

    def _picture(self, index: int, reference: Sequence[str]) -> PictureFigures:
        return PictureFigures(self._scene(index), self._runs, reference)

    def _scene(self, index: int) -> Scene:
        return self._reader.scene(self._reader.frames[index])

    def _timed(self, scene: Scene, effort: Effort, seed: int) -> tuple[Radiance, RenderCost]:
        warm = self._before == (scene.frame.index, effort)
        memory, cpu, wall = watch_memory(), time.process_time(), time.perf_counter()
        radiance = self._render(scene, effort, seed)
        cost = RenderCost(
            cpu_s=time.process_time() - cpu,
            wall_s=time.perf_counter() - wall,
            memory_bytes=memory(),
            warm=warm,
        )
        self._before = scene.frame.index, effort
        return radiance, cost

    def _render(self, scene: Scene, effort: Effort, seed: int) -> Radiance:
        settings = replace(self._studio.settings, effort=effort, seed=seed)
        return self._studio.maker.render(in_unit_light(scene), settings, Stopwatch())


def _labels(scene: Scene, label_pass: LabelPass) -> LabelImages:
    kinds = ("depth", "segmentation", "dense_pose")
    made = {kind: array for kind, array, _ in make_labels(scene, label_pass, kinds, Stopwatch())}
    return LabelImages(depth=made["depth"], part=made["segmentation"], body=made["dense_pose"])


def watch_memory() -> Callable[[], int]:
    """Begin a stretch; the returned function returns the most bytes held since. If the system has no peak that can be
    reset, it returns the bytes held at the end."""
    try:
        Path("/proc/self/clear_refs").write_text(RESET_PEAK, encoding="ascii")
    except OSError:
        return _held
    return _peak


def _peak() -> int:
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith(PEAK):
                return 1024 * int(line.split()[1])
    return _held()


def _held() -> int:
    return int(psutil.Process().memory_info().rss)
