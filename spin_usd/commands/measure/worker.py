"""The child's part of a measurement: one renderer kept open, whose renders are timed and kept.

With the time of each goes the most memory that this process held meanwhile.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import psutil

from spin_usd.accuracy.error import LabelImages, Viewpoint, agreement
from spin_usd.accuracy.measurement import Configuration
from spin_usd.basics.arrays import digest
from spin_usd.commands.measure.figures import PictureFigures
from spin_usd.commands.measure.renders import RenderCost, RenderStore
from spin_usd.picture.make_picture import Stopwatch, make_labels
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.processes.open_renderer import open_renderer
from spin_usd.processes.processors import hold_to
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.renderer import LabelPass, Renderer
from spin_usd.renderers.skipped import Requirements
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader

RESET_PEAK = "5"  # proc(5), /proc/pid/clear_refs: reset the peak resident set size to the current one
PEAK = "VmHWM:"  # proc(5), /proc/pid/status: peak resident set size, kB


class MeasuringWorker:
    """A worker that lives in a child process, with one renderer, opened with `how`.

    `folder` holds the renders that were made; `work` is for temporary files; `cpus` are the processors that it may use;
    `progress` is called with the key of each render as it is made.
    """

    def __init__(
        self,
        *,
        stage: str,
        variant: str,
        folder: str,
        work: str,
        cpus: Sequence[int],
        renderer: str,
        progress: Callable[[str], None],
        **how: Any,
    ) -> None:
        hold_to(cpus)
        self.runs = RenderStore(root=Path(folder), work=Path(work))
        self.reader = StageReader(stage, variant=variant)
        self.caster = EmbreeCaster()
        self._open = partial(open_renderer, renderer, **how)
        self.renderer: Renderer = self._open()
        self._on_made = progress
        self._work: list[str] = []
        self._before: tuple[int, Effort] | None = None

    def do(self, what: str, **arguments: Any) -> Any:
        """Do what the method of that name does."""
        return getattr(self, what)(**arguments)

    def make_runs(self, *, index: int, effort: Mapping[str, Any], seeds: Mapping[str, int]) -> None:
        """Render picture `index` with each of the seeds, keep each under its key, and report each."""
        self._do(())
        scene, wanted = self._scene(index), Effort(**effort)
        for key, seed in seeds.items():
            self.runs.keep(key, *self._timed(scene, wanted, seed))
            self._on_made(key)

    def make_pairs(
        self,
        *,
        index: int,
        effort: Mapping[str, Any],
        work: Sequence[str],
        seeds: Sequence[int],
        with_it: Sequence[str],
        without: Sequence[str],
    ) -> None:
        """Render picture `index` with each of the seeds with the `work` and without any, keep each under its key, and
        report each. The two take turns, so that what drifts does so for both; and each is rendered twice, of which the
        second is kept, so that both are timed warm."""
        scene, wanted = self._scene(index), Effort(**effort)
        for number, (seed, *keys) in enumerate(zip(seeds, with_it, without, strict=True)):
            turns = list(zip((work, ()), keys, strict=True))
            for done, key in turns if number % 2 else reversed(turns):
                self._do(done)
                self._timed(scene, wanted, seed)
                self.runs.keep(key, *self._timed(scene, wanted, seed))
                self._on_made(key)

    def render_digest(self, *, index: int, effort: Mapping[str, Any], seed: int) -> str:
        """Return the digest of the render of picture `index`, over every bit of it."""
        radiance = self._render(self._scene(index), Effort(**effort), seed)
        return digest(radiance.groups, radiance.coverage)

    def labels(self, *, index: int) -> dict[str, Any]:
        """Compare the labels of picture `index`, of its first target alone, by this renderer's own label pass with
        those that datasets hold; return LabelFigures as JSON."""
        scene, own, usual = self._scene(index).one_body_scenes[0], self.renderer, self.caster
        assert isinstance(own, LabelPass), f"{own.name} makes images alone"
        sight = Viewpoint(camera=scene.camera, T_cam_body=scene.T_cam_body)
        names = {"frame": scene.frame.name, "renderer": own.name, "against": usual.name}
        return asdict(agreement(_labels(scene, own), _labels(scene, usual), sight, **names))

    def errors(self, *, index: int, reference: Sequence[str], runs: Sequence[Sequence[str]]) -> dict[str, Any]:
        """Return mean square errors, relative: the reference's own, and of each setting's runs, all given by their
        keys."""
        picture = self._picture(index, reference)
        return {
            "reference": picture.reference.error_squared,
            "settings": [picture.linear_error(keys).squared for keys in runs],
        }

    def figures(
        self,
        *,
        index: int,
        seed: int,
        reference: Sequence[str],
        capped: bool,
        settings: Sequence[Mapping[str, Any]],
        runs: Sequence[Sequence[str]],
    ) -> dict[str, Any]:
        """Return what the runs of the settings say of the picture: its "frame" and its "figures", as JSON.

        `seed`: the dataset's, for the background; `capped`: the reference ended before it was good enough.
        """
        picture = self._picture(index, reference)
        image = picture.developed(seed)
        made = [Configuration(renderer=each["renderer"], effort=Effort(**each["effort"])) for each in settings]
        return {
            "frame": picture.frame(image),
            "figures": [
                asdict(picture.figures(image, setting, keys, capped=capped))
                for setting, keys in zip(made, runs, strict=True)
            ],
        }

    def skipped_work(self, *, index: int, effort: Mapping[str, Any]) -> list[str]:
        """Return the names of the work that a render of picture `index` does not need."""
        required = Requirements.of(self._scene(index), Effort(**effort))
        return [each.what for each in required.skipped]

    def savings(
        self,
        *,
        index: int,
        reference: Sequence[str],
        runs: Mapping[str, Mapping[str, Sequence[str]]],
    ) -> list[dict[str, Any]]:
        """Return what leaving work out saves and changes, by the runs `with_it` and `without` it of each: Saving, as
        JSON."""
        picture = self._picture(index, reference)
        return [asdict(picture.saving(work, **keys)) for work, keys in runs.items()]

    def _do(self, work: Sequence[str]) -> None:
        """Do that work in each render from now on, needed or not."""
        if list(work) != self._work:
            self.renderer.close()
            self.renderer, self._work, self._before = self._open(keep=work), list(work), None

    def _picture(self, index: int, reference: Sequence[str]) -> PictureFigures:
        return PictureFigures(self._scene(index), self.runs, reference)

    def _scene(self, index: int) -> Scene:
        return self.reader.scene(self.reader.frames[index])

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
        settings = RenderSettings(renderer=self.renderer.name, effort=effort, seed=seed)
        return PassMaker(self.caster, self.renderer).render(in_unit_light(scene), settings, Stopwatch())


def _labels(scene: Scene, label_pass: LabelPass) -> LabelImages:
    kinds = ("depth", "segmentation", "dense_pose")
    made = {kind: array for kind, array, _ in make_labels(scene, label_pass, kinds, Stopwatch())}
    return LabelImages(depth=made["depth"], part=made["segmentation"], body=made["dense_pose"])


def watch_memory() -> Callable[[], int]:
    """Begin a stretch; the function that comes back returns the most bytes held since. Where the system keeps no peak
    that can be reset, it returns what is held at the end."""
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
