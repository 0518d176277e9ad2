"""The passes of one picture, labels and light: what the cache has is taken from there, all else is made and written."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Any, Protocol

from numpy.typing import NDArray

from spin_usd.commands.render.record import CurrentPicture
from spin_usd.formats.array_file import read_array
from spin_usd.labels.table import LABELS
from spin_usd.picture.kinds import IMAGE, RADIANCE, RENDERED
from spin_usd.picture.make_picture import image_tones, make_image
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.picture.shown_bodies import TELLING, ShownBodies, shown_by_label
from spin_usd.picture.target_facts import target_facts
from spin_usd.records.record import RecordedFile
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.echoes import laser_range
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.store.cache import CacheEntry

RECORDED = (*LABELS, IMAGE, RADIANCE)  # the order of files in a record, whichever of them the cache had
WRITERS = 2  # files encoded at once: compression is most of their time, and runs outside Python's lock


class PictureFiles(Protocol):
    """Where what is made goes, and what was made before is: FileWriter's is a dataset."""

    def found_label(self, kind: str, key: str) -> CacheEntry | None: ...

    def found_render(self, key: str, scene: Scene, *, groups: int) -> Radiance | None: ...

    def keep_render(self, key: str, rendered: Radiance) -> None: ...

    def write(self, scene: Scene, kind: str, array: NDArray[Any], channels: Channels) -> RecordedFile: ...

    def write_label(
        self, key: str, scene: Scene, kind: str, array: NDArray[Any], channels: Channels
    ) -> RecordedFile: ...

    def link(self, scene: Scene, cached: CacheEntry) -> RecordedFile: ...

    def remove(self, file: RecordedFile) -> None: ...


class PicturePasses:
    """Makes what a picture shows, and has it written."""

    def __init__(self, files: PictureFiles, maker: PassMaker, settings: RenderSettings) -> None:
        self._files, self._maker, self.settings = files, maker, settings
        self._writers = ThreadPoolExecutor(max_workers=WRITERS)

    def write_all(self, picture: CurrentPicture) -> dict[str, RecordedFile]:
        """Write each file as soon as it is made; returns their entries in the record. Where one fails none stays:
        without a record they would be nobody's."""
        writing: dict[str, Future[RecordedFile]] = {}
        try:
            self._labels(picture, writing)  # written while the image is rendered
            if picture.recorded:
                with picture.watch("facts"):
                    picture.facts = target_facts(picture.scene, picture.shown, self._maker.caster)
                    if picture.scene.range_finder:
                        picture.laser = laser_range(picture.scene, self._maker.caster.first_faces)
            kept = self._image(picture, writing)
            with picture.watch("files"):
                kept.result()
                return {kind: writing[kind].result() for kind in RECORDED if kind in writing}
        except Exception:
            wait(writing.values())
            for written in writing.values():
                if written.exception() is None:
                    self._files.remove(written.result())
            raise

    def _labels(self, picture: CurrentPicture, writing: dict[str, Future[RecordedFile]]) -> None:
        """Make the labels: those that the cache has, and one pass for those that it has not."""
        wanted = [kind for kind in LABELS if kind in picture.kinds]
        keys = {kind: picture.keys.get(kind, picture.keys["geometry"]) for kind in wanted}
        with picture.watch("cache"):
            found = {kind: entry for kind, key in keys.items() if (entry := self._files.found_label(kind, key))}
        for kind, entry in found.items():
            writing[kind] = self._writers.submit(self._files.link, picture.scene, entry)
        missing = [kind for kind in wanted if kind not in found]
        if missing:
            for kind, array, channels in self._maker.labels(picture.scene, missing, self.settings, picture.watch):
                label = partial(self._files.write_label, keys[kind]) if picture.keep_labels else self._files.write
                writing[kind] = self._writers.submit(label, picture.scene, kind, array, channels)
                picture.shown = picture.shown or shown_by_label(picture.scene, kind, array)
        picture.shown = picture.shown or self._shown_by_cached(picture, found)
        if wanted:
            picture.passes["labels"] = "made" if missing else "shared"

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
        scene, settings, key = picture.scene, self.settings, picture.keys["radiance"]
        light = in_unit_light(scene)
        with picture.watch("cache"):
            rendered = self._files.found_render(key, scene, groups=len(light.gains))
        picture.passes["render"] = "shared" if rendered else "made"
        if rendered is None:
            rendered = self._maker.render(light, settings, picture.watch)
            if picture.keep_render:
                kept = self._writers.submit(self._files.keep_render, key, rendered)
        radiance = rendered.relit(light.gains)
        for kind, array, channels in make_image(scene, radiance, settings, picture.kinds, picture.watch, picture.notes):
            if kind == IMAGE and picture.recorded:
                picture.tones = image_tones(scene, radiance, array)
            writing[kind] = self._writers.submit(self._files.write, scene, kind, array, channels)
        return kept
