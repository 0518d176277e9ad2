"""The child's part of a FreshDataset: images of stored pictures developed anew from the dataset's renders."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.geometry.region import Region
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.render_file import read_render
from spin_usd.records.record import Record
from spin_usd.renderers.background.sky import sky
from spin_usd.sampling.distribution import Value
from spin_usd.sampling.sample import Sample, sample_one, stream
from spin_usd.scene.derived.content_keys import KeyMaker, background_seed, picture_seed
from spin_usd.scene.derived.light_groups import UnitLight, gains_in, in_unit_light
from spin_usd.scene.environment import BACKGROUND
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene, augmentation_and_camera, variant_of
from spin_usd.scene.texture import Color
from spin_usd.sensor.develop import KERNEL_SIGMAS, develop
from spin_usd.simulator.calls import DevelopedImage, DevelopImage, OpenFresh
from spin_usd.simulator.shared_arrays import Entry, SharedArrays
from spin_usd.specifications.appearances import Appearance, read_appearances
from spin_usd.specifications.augmentation_spec import AugmentationEntry
from spin_usd.specifications.sample_pictures import samples_for
from spin_usd.stage.augment.background import beside
from spin_usd.stage.augment.edited_stage import Edits
from spin_usd.store.cache import RENDERS, Cache
from spin_usd.store.names import record_of
from spin_usd.store.read_documents import read_record
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.recently_used import RecentlyUsed

KEPT_RENDERS = 1 << 28  # bytes
DEVELOPED = ("exposure.", "optics.", "sensor.", "sun.", "fill.", "lights.")
STRENGTH = (".factor", ".irradiance", ".temperature", ".shining")


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rendered:
    """A render of the dataset, the unit light that it was made in, and the record of its picture."""

    record: Record
    unit: UnitLight
    radiance: Radiance


@dataclass(frozen=True, kw_only=True, eq=False)
class _FreshAppearance:
    """An appearance to draw for rendered pictures."""

    of: Appearance
    samples: tuple[Sample, ...]

    def draw(self, seed: int, name: str, frame: str) -> dict[str, Value]:
        """Draw the values of a picture, by parameter."""
        values = {each.parameter: sample_one(each, seed=seed, name=name, frame=frame) for each in self.samples}
        return {**values, **self.of.photograph(seed, name, frame)}


class FreshImages:
    """Develops images in a child process."""

    def __init__(self, request: OpenFresh) -> None:
        self._root, self._seed, self._shared = Path(request.dataset), request.seed, SharedArrays(request.memory)
        self._folder = Folder(self._root)
        self._appearances = [_fresh(each, request.spec) for each in read_appearances(request.spec)]
        self._stages: dict[str, OpenStage] = {}
        self._rendered = RecentlyUsed[_Rendered](KEPT_RENDERS)
        self._known: set[tuple[object, ...]] = set()

    def image(self, request: DevelopImage) -> DevelopedImage:
        """Develop the image of a picture, or a region of it; return its place in memory, and its drawn values."""
        frame, variant = request.frame, request.variant
        rendered = self._render(record_of(variant, frame))
        record = rendered.record
        drawn = f"{self._seed}.{request.epoch}"
        chance = stream(self._seed, "appearance", variant, frame, str(request.epoch))
        appearance = self._appearances[int(chance.integers(len(self._appearances)))]
        values = appearance.draw(self._seed, f"{appearance.of.entry.name}.{request.epoch}", f"{variant}/{frame}")
        scene = self._scene(record, appearance, values)
        augmentation, camera = augmentation_and_camera(variant)
        scene = replace(scene, frame=replace(scene.frame, variant=variant_of(f"{augmentation}.{drawn}", camera)))
        gains = gains_in(rendered.unit, scene)
        if gains is None:
            self._refuse(record, appearance.of.entry)
        array = _developed(scene, rendered.radiance, gains, record, request.region)
        entries: list[Entry] = self._shared.put({IMAGE: array})
        return DevelopedImage(arrays=entries, augmentation=appearance.of.entry.name, values=values)

    def _stage(self, record: Record) -> OpenStage:
        root = record.provenance.stage.root
        if root not in self._stages:
            self._stages[root] = OpenStage(self._root / root, check_images=False)
        return self._stages[root]

    def _scene(self, record: Record, appearance: _FreshAppearance, values: Mapping[str, Value]) -> Scene:
        stage, entry = self._stage(record), appearance.of.entry
        reader = stage.reader(record.variant)
        edits = Edits(values={n: v for n, v in values.items() if n != BACKGROUND}, selections=entry.select)
        frame, behind = reader.frames[record.index], str(values.get(BACKGROUND, ""))
        edited = stage.edited(record.variant, frame, edits)
        photograph = beside(appearance.of.folder, behind) if behind else None
        scene = stage.finished(edited.scene(frame, edits), photograph)
        if (checked := (record.variant, edits.names, record.index)) not in self._known:
            base = reader.scene(frame)
            keys = KeyMaker(record.settings).keys(scene.with_lights(base.lights))
            if keys.radiance != record.provenance.keys["radiance"]:
                self._refuse(record, entry)
            self._known.add(checked)
        return scene

    def _refuse(self, record: Record, entry: AugmentationEntry) -> NoReturn:
        found = f"the augmentation {entry.name} changes more of {record.frame} than light strengths, camera and sky"
        do = "draw only these; render the rest as variants"
        raise InputError(found, where=self._root, do=do)

    def _render(self, name: str) -> _Rendered:
        """Return the render of the picture with that record, from the dataset's cache."""
        if (kept := self._rendered.find(name)) is not None:
            return kept
        record = read_record(self._folder, name)
        reader = self._stage(record).reader(record.variant)
        scene = reader.scene(reader.frames[record.index])
        unit = in_unit_light(scene)
        cache = Cache(folder=self._folder, versions=record.provenance.versions, work=self._root)
        entry = cache.find(RENDERS, record.provenance.keys["radiance"])
        radiance = read_render(entry.file, scene.picture_region, groups=len(unit.gains)) if entry else None
        if radiance is None:
            do = "render the dataset again without --no-cache; this makes no picture anew"
            raise InputError(f"contains no render of {record.frame} of {record.variant}", where=self._root, do=do)
        found = _Rendered(record=record, unit=unit, radiance=radiance.in_own_pages())
        self._rendered.keep(name, found, radiance.nbytes)
        return found


def _fresh(appearance: Appearance, spec: str) -> _FreshAppearance:
    for sample in appearance.others:
        name = sample.parameter
        light = name.startswith(("sun.", "fill.", "lights."))
        if not name.startswith(DEVELOPED) or (light and not name.endswith(STRENGTH)):
            own = ", ".join(f"{each}*" for each in DEVELOPED[:3])
            do = f"draw {own}, photographs, and strengths and colours of lights"
            where = f"{spec} augmentation {appearance.entry.name}: {name}"
            raise InputError("needs a new render", where=where, do=do)
    return _FreshAppearance(of=appearance, samples=samples_for(appearance.others))


def _developed(
    scene: Scene, radiance: Radiance, gains: Sequence[Color], record: Record, region: Sequence[int] | None
) -> NDArray[Any]:
    settings = record.settings
    seeds = background_seed(scene, settings), picture_seed(scene, settings)
    if region is None:
        return develop(scene, radiance.relit(gains), sky(scene, seed=seeds[0]), seed=seeds[1])
    x0, y0, x1, y1 = region
    wanted = Region(x0=x0, y0=y0, x1=x1, y1=y1)
    around = wanted.padded(int(np.ceil(KERNEL_SIGMAS * scene.optics.psf_sigma))) & scene.camera.frame
    behind = sky(scene, seed=seeds[0])
    part = None if behind is None else behind[around.slices]
    metered = radiance if scene.sensor.auto_exposure else radiance.within(around)
    made = develop(scene, metered.relit(gains), part, seed=seeds[1], region=around)
    return np.ascontiguousarray(made[wanted.within(around).slices])
