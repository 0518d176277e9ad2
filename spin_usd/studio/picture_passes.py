"""The passes of one picture, labels and light: taken from the cache if there, else made and written."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Any, Protocol

from numpy.typing import NDArray

from spin_usd.formats.array_file import read_array
from spin_usd.labels.table import LABELS
from spin_usd.picture.kinds import IMAGE, RADIANCE, RENDERED
from spin_usd.picture.make_picture import image_tones, make_image
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.picture.shown_bodies import TELLING, ShownBodies, shown_by_label
from spin_usd.picture.target_facts import target_facts
from spin_usd.records.record import RecordedFile
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.echoes import laser_range
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.store.cache import CacheEntry
from spin_usd.studio.record import CurrentPicture

RECORDED = (*LABELS, IMAGE, RADIANCE)  # the order of files in a record, whether from the cache or not
WRITERS = 2  # files encoded at once: compression is most of their time, and runs outside Python's lock


class Sink(Protocol):
    """The destination of a picture's arrays, with results kept from earlier pictures: a dataset, or memory. Its methods
    are called from several threads."""

    def found_label(self, kind: str, key: str) -> CacheEntry | None: ...

    def found_render(self, key: str, scene: Scene, *, groups: int) -> Radiance | None: ...

    def keep_render(self, key: str, rendered: Radiance) -> None: ...

    def write(
        self, scene: Scene, kind: str, array: NDArray[Any], channels: Channels, *, key: str | None = None
    ) -> RecordedFile:
        """Take one file; with `key` it is a label that is kept for other pictures. Return its entry in the record."""

    def link(self, scene: Scene, cached: CacheEntry) -> RecordedFile: ...

    def remove(self, file: RecordedFile) -> None: ...


class PicturePasses:
    """Makes the contents of pictures, and gives them to their sinks."""

    def __init__(self, maker: PassMaker) -> None:
        self._maker = maker
        self._writers = ThreadPoolExecutor(max_workers=WRITERS)

    def write_all(self, picture: CurrentPicture, sink: Sink) -> dict[str, RecordedFile]:
        """Write each file as soon as it is made; return their entries in the record. If one fails, all are removed, for
        no record would list them."""
        writing: dict[str, Future[RecordedFile]] = {}
        try:
            self._labels(picture, sink, writing)  # written while the image is rendered
            if picture.recorded:
                with picture.watch("facts"):
                    picture.facts = target_facts(picture.scene, picture.shown, self._maker.caster)
                    if picture.scene.range_finder:
                        picture.laser = laser_range(picture.scene, self._maker.caster.first_faces)
            kept = self._image(picture, sink, writing)
            with picture.watch("files"):
                kept.result()
                return {kind: writing[kind].result() for kind in RECORDED if kind in writing}
        except Exception:
            wait(writing.values())
            for written in writing.values():
                if written.exception() is None:
                    sink.remove(written.result())
            raise

    def _labels(self, picture: CurrentPicture, sink: Sink, writing: dict[str, Future[RecordedFile]]) -> None:
        """Make the labels: from the cache, and by one pass for the others."""
        wanted = [kind for kind in LABELS if kind in picture.kinds]
        keys = {kind: picture.keys.get(kind, picture.keys["geometry"]) for kind in wanted}
        with picture.watch("cache"):
            found = {kind: entry for kind, key in keys.items() if (entry := sink.found_label(kind, key))}
        for kind, entry in found.items():
            writing[kind] = self._writers.submit(sink.link, picture.scene, entry)
        missing = [kind for kind in wanted if kind not in found]
        if missing:
            for kind, array, channels in self._maker.labels(picture.scene, missing, picture.settings, picture.watch):
                write = partial(sink.write, key=keys[kind] if picture.keep_labels else None)
                writing[kind] = self._writers.submit(write, picture.scene, kind, array, channels)
                picture.shown = picture.shown or shown_by_label(picture.scene, kind, array)
        picture.shown = picture.shown or self._shown_by_cached(picture, found)
        if wanted:
            picture.passes["labels"] = "made" if missing else "shared"

    def _shown_by_cached(self, picture: CurrentPicture, found: Mapping[str, CacheEntry]) -> ShownBodies | None:
        """Return the bodies in the cached labels, if one of them contains them."""
        with picture.watch("cache"):
            telling = ((kind, found[kind].file) for kind in found if kind in TELLING)
            shown = (shown_by_label(picture.scene, kind, read_array(file)) for kind, file in telling)
            return next(filter(None, shown), None)

    def _image(self, picture: CurrentPicture, sink: Sink, writing: dict[str, Future[RecordedFile]]) -> Future[Any]:
        """Make the image and the radiance file, from the sink's render or a new one; return a future, done once that is
        stored."""
        kept: Future[Any] = Future()
        kept.set_result(None)
        if RENDERED.isdisjoint(picture.kinds):
            return kept
        scene, settings, key = picture.scene, picture.settings, picture.keys["radiance"]
        light = in_unit_light(scene)
        with picture.watch("cache"):
            rendered = sink.found_render(key, scene, groups=len(light.gains))
        picture.passes["render"] = "shared" if rendered else "made"
        if rendered is None:
            rendered = self._maker.render(light, settings, picture.watch)
            if picture.keep_render:
                kept = self._writers.submit(sink.keep_render, key, rendered)
        radiance = rendered.relit(light.gains)
        for kind, array, channels in make_image(scene, radiance, settings, picture.kinds, picture.watch, picture.notes):
            if kind == IMAGE and picture.recorded:
                picture.tones = image_tones(scene, radiance, array)
            writing[kind] = self._writers.submit(sink.write, scene, kind, array, channels)
        return kept
