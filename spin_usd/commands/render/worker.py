"""A worker: one renderer and one ray caster kept open, pictures made one after another, each written and recorded."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

import psutil
from msgspec import convert, to_builtins
from numpy.typing import NDArray

from spin_usd.commands.render.record import CurrentPicture, make_record
from spin_usd.commands.render.worker_options import MadePicture, WorkerOptions
from spin_usd.errors import InputError
from spin_usd.files.changes import remove_file
from spin_usd.formats.array_file import encoded_array, read_array
from spin_usd.labels.table import CLOUD_LABELS, LABELS, other_views, own_keys
from spin_usd.picture.brightness import faults
from spin_usd.picture.kinds import IMAGE, RADIANCE, RENDERED
from spin_usd.picture.make_picture import Made, Stopwatch, image_tones, make_clouds, make_image, make_labels, render_in
from spin_usd.picture.render_file import RENDER_SUFFIX, encoded_render, in_order, read_render
from spin_usd.picture.shown_bodies import TELLING, ShownBodies, shown_by_label
from spin_usd.picture.target_facts import target_facts
from spin_usd.picture.versions import library_versions
from spin_usd.planning.in_child import stage_provenance
from spin_usd.processes.open_renderer import open_renderer
from spin_usd.processes.processors import hold_to
from spin_usd.records.record import Record, RecordedFile
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.renderer import Renderer
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.content_keys import KeyMaker, render_seed
from spin_usd.scene.derived.echoes import laser_range
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Radiance
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.atomic import link_atomically, write_atomically, write_json
from spin_usd.store.cache import RENDERS, Cache, CacheEntry
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import record_of
from spin_usd.store.read_documents import read_record, recorded_files

RECORDED = (*LABELS, IMAGE, RADIANCE)  # the order of files in a record, whichever of them the cache had
WRITERS = 2  # files encoded at once: compression is most of their time, and runs outside Python's lock


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
        self.caster = EmbreeCaster()
        self.renderer = self._open_renderer() if self.options.renders else None
        self.versions = library_versions() | (self.renderer.versions() if self.renderer else {})
        self.cache = Cache(folder=self.store.folder, versions=self.versions, work=self.work)
        self._writers = ThreadPoolExecutor(max_workers=WRITERS)
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
        before = self.withdraw(variant, scene.frame.name)
        files = self._write_all(picture)
        with watch("files"):
            record = make_record(stage_provenance(reader), picture, self.options, files, self.versions)
            name = record_of(variant, scene.frame.name)
            write_json(self.store.folder, name, to_builtins(record), work=self.work)
            had = recorded_files(before, variant, scene.frame.name).values()
            for stale in set(had) - {file.path for file in files.values()}:
                remove_file(self.store.folder, stale)
        return picture, record

    def _open_renderer(self) -> Renderer:
        settings = self.options.settings
        return open_renderer(settings.renderer, device=settings.device, caster=self.caster)

    def _write_all(self, picture: CurrentPicture) -> dict[str, RecordedFile]:
        """Write each file as soon as it is made; returns their entries in the record. Where one fails none stays:
        without a record they would be nobody's."""
        writing: dict[str, Future[RecordedFile]] = {}
        try:
            self._labels(picture, writing)  # written while the image is rendered
            with picture.watch("facts"):
                picture.facts = target_facts(picture.scene, picture.shown, self.caster)
                if picture.scene.range_finder:
                    picture.laser = laser_range(picture.scene, self.caster.first_faces)
            kept = self._image(picture, writing)
            with picture.watch("files"):
                kept.result()
                return {kind: writing[kind].result() for kind in RECORDED if kind in writing}
        except Exception:
            wait(writing.values())
            for written in writing.values():
                if written.exception() is None:
                    remove_file(self.store.folder, written.result().path)
            raise

    def _labels(self, picture: CurrentPicture, writing: dict[str, Future[RecordedFile]]) -> None:
        """Make the labels: those that the cache has, and one pass for those that it has not."""
        wanted = [kind for kind in LABELS if kind in picture.kinds]
        keys = {kind: picture.keys.get(kind, picture.keys["geometry"]) for kind in wanted}
        with picture.watch("cache"):
            found = {kind: entry for kind, key in keys.items() if (entry := self.cache.find(kind, key))}
        for kind, entry in found.items():
            writing[kind] = self._writers.submit(self._link, picture.scene, entry)
        missing = [kind for kind in wanted if kind not in found]
        if missing:
            for kind, array, channels in self._made_labels(picture, missing):
                label = partial(self._label, keys[kind]) if picture.keep_labels else self._write
                writing[kind] = self._writers.submit(label, picture.scene, kind, array, channels)
                picture.shown = picture.shown or shown_by_label(picture.scene, kind, array)
        picture.shown = picture.shown or self._shown_by_cached(picture, found)
        if wanted:
            picture.passes["labels"] = "made" if missing else "shared"

    def _made_labels(self, picture: CurrentPicture, kinds: Sequence[str]) -> Iterator[Made]:
        """Make the labels of these kinds."""
        yield from make_labels(picture.scene, self.caster, kinds, picture.watch, self.caster)
        if any(kind in CLOUD_LABELS for kind in kinds):
            seed, beams = render_seed(picture.scene, self.options.settings), self.caster.first_faces
            yield from make_clouds(picture.scene, beams, kinds, picture.watch, seed=seed)

    def _shown_by_cached(self, picture: CurrentPicture, found: Mapping[str, CacheEntry]) -> ShownBodies | None:
        """Return the bodies that the cached labels show, where one of them says so."""
        with picture.watch("cache"):
            telling = ((kind, found[kind].file) for kind in found if kind in TELLING)
            shown = (shown_by_label(picture.scene, kind, read_array(file)) for kind, file in telling)
            return next(filter(None, shown), None)

    def _image(self, picture: CurrentPicture, writing: dict[str, Future[RecordedFile]]) -> Future[Any]:
        """Make the image and the radiance file, from the cache's render or a new one; the result says when that is
        kept."""
        kept: Future[Any] = Future()
        kept.set_result(None)
        if RENDERED.isdisjoint(picture.kinds):
            return kept
        scene, settings, key = picture.scene, self.options.settings, picture.keys["radiance"]
        light = in_unit_light(scene)
        with picture.watch("cache"):
            rendered = self._cached_render(key, scene, groups=len(light.gains))
        picture.passes["render"] = "shared" if rendered else "made"
        if rendered is None:
            assert self.renderer, "the run was said to render nothing"
            rendered = in_order(render_in(light, self.renderer, settings, picture.watch))
            if picture.keep_render:
                encode = partial(encoded_render, rendered)
                kept = self._writers.submit(self.cache.keep, RENDERS, key, RENDER_SUFFIX, encode)
        radiance = rendered.relit(light.gains)
        for kind, array, channels in make_image(scene, radiance, settings, picture.kinds, picture.watch, picture.notes):
            if kind == IMAGE:
                picture.tones = image_tones(scene, radiance, array)
            writing[kind] = self._writers.submit(self._write, scene, kind, array, channels)
        return kept

    def _cached_render(self, key: str, scene: Scene, *, groups: int) -> Radiance | None:
        entry = self.cache.find(RENDERS, key)
        return read_render(entry.file, scene.picture_region, groups=groups) if entry else None

    def _write(self, scene: Scene, kind: str, array: NDArray[Any], channels: Channels) -> RecordedFile:
        """Write one file; returns its entry in the record."""
        name = self._name(scene, kind)
        encode = _encoding(name, kind, array, channels)
        digest = write_atomically(self.store.folder, name, encode, work=self.work, forced=False)
        return RecordedFile(path=name, sha256=digest, **channels.described)

    def _label(self, key: str, scene: Scene, kind: str, array: NDArray[Any], channels: Channels) -> RecordedFile:
        """Write one label, which the cache keeps too; returns its entry in the record."""
        name = self._name(scene, kind)
        encode = _encoding(name, kind, array, channels)
        kept = self.cache.keep(kind, key, LABELS[kind].suffix, encode, also=name)
        return RecordedFile(path=name, sha256=kept.sha256, **channels.described)

    def _link(self, scene: Scene, cached: CacheEntry) -> RecordedFile:
        """Link one label that the cache had; returns its entry in the record."""
        kind = cached.purpose.kind
        name = self._name(scene, kind)
        link_atomically(self.store.folder, name, cached.file, work=self.work)
        return RecordedFile(path=name, sha256=cached.sha256, **LABELS[kind].channels.described)

    def _name(self, scene: Scene, kind: str) -> str:
        return f"{kind}/{scene.frame.variant}/{scene.frame.name}{suffix_of(kind, self.options.image_suffix)}"

    def withdraw(self, variant: str, frame: str) -> Record | None:
        """Remove a picture's old record, so that none ever describes files being replaced; returns it, None where there
        was none that can be used."""
        name, record = record_of(variant, frame), None
        with suppress(InputError):
            record = read_record(self.store.folder, name)
        remove_file(self.store.folder, name)
        return record

    def reader(self, variant: str) -> StageReader:
        """Return the stage in that variant. One is kept open: pictures come ordered by variant."""
        if self._reader is None or self._reader.variant != variant:
            root = self.store.root / self.options.stage
            self._reader = StageReader(root, variant=variant, after=self._reader, check_images=False)  # the plan did
        return self._reader


def _encoding(name: str, kind: str, array: NDArray[Any], channels: Channels) -> Callable[[], bytes]:
    """Return the function that encodes the file `name` of that `kind`."""
    return partial(encoded_array, array, PurePosixPath(name).suffix, kind=kind, channels=channels)


def suffix_of(kind: str, image_suffix: str) -> str:
    """Return the file name extension of a kind of file."""
    if kind == IMAGE:
        return image_suffix
    return ".exr" if kind == RADIANCE else LABELS[kind].suffix
