"""The passes of one picture, labels and light: what the cache has is taken from there, all else is made and written."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Any

from spin_usd.commands.render.file_writer import FileWriter
from spin_usd.commands.render.record import CurrentPicture
from spin_usd.formats.array_file import read_array
from spin_usd.labels.table import CLOUD_LABELS, LABELS
from spin_usd.picture.kinds import IMAGE, RADIANCE, RENDERED
from spin_usd.picture.make_picture import Made, image_tones, make_clouds, make_image, make_labels, render_in
from spin_usd.picture.render_file import RENDER_SUFFIX, encoded_render, in_order, read_render
from spin_usd.picture.shown_bodies import TELLING, ShownBodies, shown_by_label
from spin_usd.picture.target_facts import target_facts
from spin_usd.records.record import RecordedFile
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.renderer import Renderer
from spin_usd.scene.derived.content_keys import RenderSettings, render_seed
from spin_usd.scene.derived.echoes import laser_range
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.store.cache import RENDERS, Cache, CacheEntry

RECORDED = (*LABELS, IMAGE, RADIANCE)  # the order of files in a record, whichever of them the cache had
WRITERS = 2  # files encoded at once: compression is most of their time, and runs outside Python's lock


class PicturePasses:
    """Makes what a picture shows, and has it written. `renderer`: None where the run renders no light."""

    def __init__(
        self, files: FileWriter, cache: Cache, caster: EmbreeCaster, renderer: Renderer | None, settings: RenderSettings
    ) -> None:
        self._files, self._cache, self._caster, self._renderer = files, cache, caster, renderer
        self._settings = settings
        self._writers = ThreadPoolExecutor(max_workers=WRITERS)

    def write_all(self, picture: CurrentPicture) -> dict[str, RecordedFile]:
        """Write each file as soon as it is made; returns their entries in the record. Where one fails none stays:
        without a record they would be nobody's."""
        writing: dict[str, Future[RecordedFile]] = {}
        try:
            self._labels(picture, writing)  # written while the image is rendered
            with picture.watch("facts"):
                picture.facts = target_facts(picture.scene, picture.shown, self._caster)
                if picture.scene.range_finder:
                    picture.laser = laser_range(picture.scene, self._caster.first_faces)
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
            found = {kind: entry for kind, key in keys.items() if (entry := self._cache.find(kind, key))}
        for kind, entry in found.items():
            writing[kind] = self._writers.submit(self._files.link, picture.scene, entry)
        missing = [kind for kind in wanted if kind not in found]
        if missing:
            for kind, array, channels in self._made_labels(picture, missing):
                label = partial(self._files.write_label, keys[kind]) if picture.keep_labels else self._files.write
                writing[kind] = self._writers.submit(label, picture.scene, kind, array, channels)
                picture.shown = picture.shown or shown_by_label(picture.scene, kind, array)
        picture.shown = picture.shown or self._shown_by_cached(picture, found)
        if wanted:
            picture.passes["labels"] = "made" if missing else "shared"

    def _made_labels(self, picture: CurrentPicture, kinds: Sequence[str]) -> Iterator[Made]:
        """Make the labels of these kinds."""
        yield from make_labels(picture.scene, self._caster, kinds, picture.watch, self._caster)
        if any(kind in CLOUD_LABELS for kind in kinds):
            seed, beams = render_seed(picture.scene, self._settings), self._caster.first_faces
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
        scene, settings, key = picture.scene, self._settings, picture.keys["radiance"]
        light = in_unit_light(scene)
        with picture.watch("cache"):
            rendered = self._cached_render(key, scene, groups=len(light.gains))
        picture.passes["render"] = "shared" if rendered else "made"
        if rendered is None:
            assert self._renderer, "the run was said to render nothing"
            rendered = in_order(render_in(light, self._renderer, settings, picture.watch))
            if picture.keep_render:
                encode = partial(encoded_render, rendered)
                kept = self._writers.submit(self._cache.keep, RENDERS, key, RENDER_SUFFIX, encode)
        radiance = rendered.relit(light.gains)
        for kind, array, channels in make_image(scene, radiance, settings, picture.kinds, picture.watch, picture.notes):
            if kind == IMAGE:
                picture.tones = image_tones(scene, radiance, array)
            writing[kind] = self._writers.submit(self._files.write, scene, kind, array, channels)
        return kept

    def _cached_render(self, key: str, scene: Scene, *, groups: int) -> Radiance | None:
        entry = self._cache.find(RENDERS, key)
        return read_render(entry.file, scene.picture_region, groups=groups) if entry else None
