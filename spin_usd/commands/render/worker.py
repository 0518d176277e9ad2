"""The child's part of `render`: a studio and a stage kept open, pictures made one after another, each recorded."""

from collections.abc import Callable
from pathlib import Path

import psutil

from spin_usd.commands.render.calls import MadePicture, MakePicture, OpenWorker
from spin_usd.labels.table import other_views
from spin_usd.picture.brightness import faults
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.processes.processors import hold_to
from spin_usd.records.record import Record
from spin_usd.store.cache import Cache
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import record_of
from spin_usd.studio.dataset_sink import DatasetSink
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.record import CurrentPicture, make_record
from spin_usd.studio.studio import Studio


class RenderWorker:
    """A worker that lives in a child process. `progress` is called in each picture once its scene is read: the time of
    the rest depends on the picture, not on the stage."""

    def __init__(self, request: OpenWorker, progress: Callable[[], None] = lambda: None) -> None:
        if request.cpus:
            hold_to(request.cpus)
        self._on_open, self.options = progress, request.options
        store, work = Store(root=Path(self.options.root)), Path(self.options.work)
        # pictures come ordered by variant; the plan has checked the images
        self.stage = OpenStage(store.root / self.options.stage, check_images=False, kept=1)
        self.studio = Studio(self.options.settings)
        if self.options.renders:
            self.studio.open_renderer()
        cache = Cache(folder=store.folder, versions=self.studio.versions, work=work)
        self._sink = DatasetSink(store, cache, work=work, image_suffix=self.options.image_suffix)

    @property
    def opened(self) -> dict[str, str]:
        """Versions of the software."""
        return self.studio.versions

    def picture(self, request: MakePicture) -> MadePicture:
        """Make a picture as `make` does, and return its costs."""
        picture, record = self.make(request)
        return MadePicture(
            record=record_of(record.variant, record.frame),
            seconds=picture.watch.seconds,
            memory=psutil.Process().memory_info().rss,
            passes=picture.passes,
            faults=faults(record),
        )

    def make(self, request: MakePicture) -> tuple[CurrentPicture, Record]:
        """Make a picture with passes from the cache, and store new ones there if requested. A picture that fails leaves
        none of its files, except those in the cache."""
        watch, variant = Stopwatch(), request.variant
        with watch("stage" if self.stage.has(variant) else "opening"):
            reader = self.stage.reader(variant)
            scene = reader.scene(reader.frames[request.index], views=other_views(request.kinds))
        self._on_open()
        before = self._sink.withdraw(variant, scene.frame.name)
        picture = self.studio.make(
            scene,
            request.kinds,
            self._sink,
            watch,
            keep_render=request.keep_render,
            keep_labels=request.keep_labels,
        )
        with watch("files"):
            record = make_record(reader.provenance(self.options.stage), picture, self.options, self.studio.versions)
            self._sink.write_record(record, before)
        return picture, record
