"""A worker: one renderer and one ray caster kept open, pictures made one after another, each written and recorded."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import psutil
from msgspec import convert

from spin_usd.commands.render.file_writer import FileWriter
from spin_usd.commands.render.picture_passes import PicturePasses
from spin_usd.commands.render.record import CurrentPicture, make_record
from spin_usd.labels.table import other_views, own_keys
from spin_usd.picture.brightness import faults
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.picture.versions import library_versions
from spin_usd.planning.in_child import stage_provenance
from spin_usd.planning.worker_options import MadePicture, WorkerOptions
from spin_usd.processes.open_renderer import open_renderer
from spin_usd.processes.processors import hold_to
from spin_usd.records.record import Record
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings, render_seed
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.cache import Cache
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import record_of


class Worker:
    """A worker that lives in a child process. `cpus`: the processors that it may use; `progress` is called in each
    picture once its scene is read: what follows takes time by the picture, not by the stage."""

    def __init__(
        self,
        *,
        options: dict[str, Any],
        cpus: Sequence[int] | None = None,
        progress: Callable[[], None] = lambda: None,
    ) -> None:
        if cpus:
            hold_to(cpus)
        self._on_open = progress
        self.options = convert(options, WorkerOptions)
        self.store, self.work = Store(root=Path(self.options.root)), Path(self.options.work)
        self.maker = open_maker(self.options.settings, renders=self.options.renders)
        self.versions = library_versions() | (self.maker.renderer.versions() if self.maker.renderer else {})
        self.cache = Cache(folder=self.store.folder, versions=self.versions, work=self.work)
        self._files = FileWriter(self.store, self.cache, work=self.work, image_suffix=self.options.image_suffix)
        self._passes = PicturePasses(self._files, self.maker, self.options.settings)
        self._reader: StageReader | None = None
        self._keys = KeyMaker(self.options.settings)

    @property
    def opened(self) -> dict[str, str]:
        """The versions of the software, for whoever opened it in another process."""
        return self.versions

    def picture(
        self,
        *,
        variant: str,
        index: int,
        kinds: Sequence[str],
        keep_render: bool = True,
        keep_labels: bool = True,
    ) -> MadePicture:
        """Make picture `index` of `variant` as `make` does, and say what it took."""
        picture, record = self.make(
            variant=variant, index=index, kinds=kinds, keep_render=keep_render, keep_labels=keep_labels
        )
        return MadePicture(
            record=record_of(record.variant, record.frame),
            seconds=picture.watch.seconds,
            memory=psutil.Process().memory_info().rss,
            passes=picture.passes,
            faults=faults(record),
        )

    def make(
        self,
        *,
        variant: str,
        index: int,
        kinds: Sequence[str],
        keep_render: bool = True,
        keep_labels: bool = True,
    ) -> tuple[CurrentPicture, Record]:
        """Make picture `index` of `variant` from what the cache has, and keep there what it has not; a render only
        with `keep_render`, labels only with `keep_labels`. One that fails leaves none of the files that it wrote, but
        those in the cache."""
        watch = Stopwatch()
        with watch("stage" if self._reader and self._reader.variant == variant else "opening"):
            reader = self.reader(variant)
            scene = reader.scene(reader.frames[index], views=other_views(kinds))
        self._on_open()
        keys = self._keys.keys(scene)
        seed = render_seed(scene, self.options.settings)
        of_content = {**asdict(keys), **own_keys(kinds, scene, keys.geometry, seed)}
        picture = CurrentPicture(
            scene=scene, kinds=kinds, keys=of_content, watch=watch, keep_render=keep_render, keep_labels=keep_labels
        )
        before = self._files.withdraw(variant, scene.frame.name)
        files = self._passes.write_all(picture)
        with watch("files"):
            record = make_record(stage_provenance(reader), picture, self.options, files, self.versions)
            self._files.write_record(record, before)
        return picture, record

    def reader(self, variant: str) -> StageReader:
        """Return the stage in that variant. One is kept open: pictures come ordered by variant."""
        if self._reader is None or self._reader.variant != variant:
            root = self.store.root / self.options.stage
            self._reader = StageReader(root, variant=variant, after=self._reader, check_images=False)  # the plan did
        return self._reader


def open_maker(settings: RenderSettings, *, renders: bool) -> PassMaker:
    """Open what makes pictures with these settings; without `renders` labels alone."""
    caster = EmbreeCaster()
    renderer = open_renderer(settings.renderer, device=settings.device, caster=caster) if renders else None
    return PassMaker(caster, renderer)
