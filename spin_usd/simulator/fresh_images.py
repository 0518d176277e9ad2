"""The child's part of a FreshDataset: images of stored pictures developed anew from the dataset's renders."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from spin_usd.commands.author.sample_pictures import samples_for
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.formats.augmentation_spec import AugmentationEntry
from spin_usd.geometry.region import Region
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.render_file import read_render
from spin_usd.records.record import Record
from spin_usd.renderers.background.sky import sky
from spin_usd.sampling.distribution import Value
from spin_usd.sampling.sample import Sample, sample_one, stream
from spin_usd.scene.derived.content_keys import KeyMaker, background_seed, picture_seed
from spin_usd.scene.derived.known_targets import KnownTargets
from spin_usd.scene.derived.light_groups import UnitLight, gains_in, in_unit_light
from spin_usd.scene.environment import BACKGROUND
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene, augmentation_and_camera, variant_of
from spin_usd.scene.texture import Color
from spin_usd.sensor.develop import KERNEL_SIGMAS, develop
from spin_usd.simulator.appearances import Appearance, Photographs, read_appearances
from spin_usd.simulator.picture_request import DevelopedImage
from spin_usd.simulator.recently_used import RecentlyUsed
from spin_usd.simulator.shared_arrays import Entry, SharedArrays
from spin_usd.stage.augment.background import beside
from spin_usd.stage.augment.edited_stage import EditedStage, Edits
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.cache import RENDERS, Cache
from spin_usd.store.names import record_of
from spin_usd.store.read_documents import read_record

KEPT_RENDERS = 1 << 28  # bytes
DEVELOPED = ("exposure.", "optics.", "sensor.", "sun.", "fill.", "lights.")
STRENGTH = (".factor", ".irradiance", ".temperature", ".shining")


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rendered:
    """A render of the dataset, the unit light that it was made in, and what is recorded of its picture."""

    said: Record
    unit: UnitLight
    radiance: Radiance


@dataclass(frozen=True, kw_only=True, eq=False)
class _FreshAppearance:
    """An appearance that is drawn for pictures that are rendered."""

    of: Appearance
    samples: tuple[Sample, ...]

    def draw(self, seed: int, name: str, frame: str) -> dict[str, Value]:
        """Draw the values of a picture, by parameter."""
        values = {each.parameter: sample_one(each, seed=seed, name=name, frame=frame) for each in self.samples}
        return {**values, **self.of.photograph(seed, name, frame)}


class FreshImages:
    """Develops images in a child process. `spec`: the specification's file; `memory`: that of SharedArrays."""

    def __init__(self, *, dataset: str, spec: str, seed: int, memory: int) -> None:
        self._root, self._seed, self._shared = Path(dataset), seed, SharedArrays(memory)
        self._folder = Folder(self._root)
        self._appearances = [_fresh(each, spec) for each in read_appearances(spec)]
        self._readers: dict[str, StageReader] = {}
        self._edited: dict[tuple[object, ...], EditedStage] = {}
        self._rendered = RecentlyUsed[_Rendered](KEPT_RENDERS)
        self._known: set[tuple[object, ...]] = set()
        self._targets = KnownTargets()
        self._photographs = Photographs()

    def image(self, *, frame: str, variant: str, epoch: int, region: Sequence[int] | None) -> DevelopedImage:
        """Develop the image of a picture, or of its `region` x0, y0, x1, y1; return where it is, and what was drawn."""
        rendered = self._render(record_of(variant, frame))
        said = rendered.said
        drawn = f"{self._seed}.{epoch}"
        chance = stream(self._seed, "appearance", variant, frame, str(epoch))
        appearance = self._appearances[int(chance.integers(len(self._appearances)))]
        values = appearance.draw(self._seed, f"{appearance.of.entry.name}.{epoch}", f"{variant}/{frame}")
        scene = self._scene(said, appearance, values)
        augmentation, camera = augmentation_and_camera(variant)
        scene = replace(scene, frame=replace(scene.frame, variant=variant_of(f"{augmentation}.{drawn}", camera)))
        gains = gains_in(rendered.unit, scene)
        if gains is None:
            self._refuse(said, appearance.of.entry)
        array = _developed(scene, rendered.radiance, gains, said, region)
        entries: list[Entry] = self._shared.put({IMAGE: array})
        return DevelopedImage(arrays=entries, augmentation=appearance.of.entry.name, values=values)

    def _reader(self, said: Record) -> StageReader:
        if said.variant not in self._readers:
            path = self._root / said.provenance.stage.root
            after = next(iter(self._readers.values()), None)
            self._readers[said.variant] = StageReader(path, variant=said.variant, after=after, check_images=False)
        return self._readers[said.variant]

    def _scene(self, said: Record, appearance: _FreshAppearance, values: Mapping[str, Value]) -> Scene:
        reader, entry = self._reader(said), appearance.of.entry
        edits = Edits(values={n: v for n, v in values.items() if n != BACKGROUND}, selections=entry.select)
        frame, key = reader.frames[said.index], (said.variant, edits.names)
        if key not in self._edited:
            self._edited[key] = EditedStage(self._root / said.provenance.stage.root, reader, frame, edits)
        scene = self._targets.in_place(self._edited[key].scene(frame, edits))
        if behind := str(values.get(BACKGROUND, "")):
            file = beside(appearance.of.folder, behind)
            scene = replace(scene, environment=self._photographs.behind(file))
        if (checked := (*key, said.index)) not in self._known:
            base = reader.scene(frame)
            keys = KeyMaker(said.settings).keys(scene.with_lights(base.lights))
            if keys.radiance != said.provenance.keys["radiance"]:
                self._refuse(said, entry)
            self._known.add(checked)
        return scene

    def _refuse(self, said: Record, entry: AugmentationEntry) -> NoReturn:
        found = f"the augmentation {entry.name} changes more of {said.frame} than strengths of light, camera and sky"
        do = "draw what a render keeps apart alone; render the rest as variants"
        raise InputError(found, where=self._root, do=do)

    def _render(self, name: str) -> _Rendered:
        """Return the render of the picture with that record, from the dataset's cache."""
        if (kept := self._rendered.find(name)) is not None:
            return kept
        said = read_record(self._folder, name)
        reader = self._reader(said)
        scene = reader.scene(reader.frames[said.index])
        unit = in_unit_light(scene)
        cache = Cache(folder=self._folder, versions=said.provenance.versions, work=self._root)
        entry = cache.find(RENDERS, said.provenance.keys["radiance"])
        radiance = read_render(entry.file, scene.picture_region, groups=len(unit.gains)) if entry else None
        if radiance is None:
            do = "render the dataset again without --no-cache, which makes no picture anew"
            raise InputError(f"keeps no render of {said.frame} of {said.variant}", where=self._root, do=do)
        found = _Rendered(said=said, unit=unit, radiance=radiance.in_own_pages())
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
    scene: Scene, radiance: Radiance, gains: Sequence[Color], said: Record, region: Sequence[int] | None
) -> NDArray[Any]:
    settings = said.settings
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
