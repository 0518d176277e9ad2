"""The child's part of a simulator: a stage kept open, and pictures of it made in memory."""

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import convert, structs
from msgspec.json import encode
from numpy.typing import NDArray

from spin_usd.commands.render.picture_passes import PicturePasses
from spin_usd.commands.render.record import CurrentPicture, make_record
from spin_usd.errors import InputError
from spin_usd.labels.table import other_views, own_keys
from spin_usd.picture.kinds import RENDERED
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.picture.versions import library_versions
from spin_usd.planning.in_child import stage_content, stage_provenance
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.open_renderer import open_renderer
from spin_usd.processes.processors import hold_to
from spin_usd.records.record import RecordedCamera, RecordedFile, RecordedPose
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.content_keys import KeyMaker, render_seed
from spin_usd.scene.derived.known_targets import KnownTargets
from spin_usd.scene.environment import BACKGROUND
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import FrameId, Scene
from spin_usd.simulator.appearances import Photographs
from spin_usd.simulator.drawn_pictures import DrawnPictures
from spin_usd.simulator.picture_request import MadeInMemory, OpenedSimulator, PictureRequest
from spin_usd.simulator.recently_used import RecentlyUsed
from spin_usd.simulator.shared_arrays import SharedArrays
from spin_usd.stage.augment.attribute_change import BaseStage
from spin_usd.stage.augment.edited_stage import EditedStage, Edits
from spin_usd.stage.read.frames import frame_named
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.cache import CacheEntry

KEPT_RENDERS = 1 << 26  # bytes: what the pictures before in other strengths of light are made of
KEPT_STAGES = 8  # opened to edit the same things again


class PicturesInMemory:
    """Takes what PicturePasses makes, and keeps renders for the pictures after it."""

    def __init__(self) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}
        self.recorded = True
        self._renders = RecentlyUsed[Radiance](KEPT_RENDERS)

    def found_label(self, kind: str, key: str) -> CacheEntry | None:
        """Find none."""
        return None

    def found_render(self, key: str, scene: Scene, *, groups: int) -> Radiance | None:
        """Return a render that was kept."""
        return self._renders.find(key)

    def keep_render(self, key: str, rendered: Radiance) -> None:
        """Keep a render."""
        self._renders.keep(key, rendered.in_own_pages(), rendered.nbytes)

    def write(self, scene: Scene, kind: str, array: NDArray[Any], channels: Channels) -> RecordedFile:
        """Take an array; its entry in the record has the digest of its bytes in memory, rows from the top."""
        self.arrays[kind] = array = np.ascontiguousarray(array)
        path = f"{kind}/{scene.frame.variant}/{scene.frame.name}"
        return RecordedFile(path=path, sha256=sha256(array).hexdigest() if self.recorded else "", **channels.described)

    def write_label(self, key: str, scene: Scene, kind: str, array: NDArray[Any], channels: Channels) -> RecordedFile:
        """Take an array."""
        return self.write(scene, kind, array, channels)

    def link(self, scene: Scene, cached: CacheEntry) -> RecordedFile:
        raise AssertionError("no label is found")

    def remove(self, file: RecordedFile) -> None:
        """Do nothing: the arrays of the next picture take the place."""


class StagePictures:
    """Pictures of a stage, made in a child process. `memory`: that of SharedArrays; `cpus`: the processors that it may
    use; `seed`: that of all that is random, None for the stage's own."""

    def __init__(
        self,
        *,
        stage: str,
        options: dict[str, Any],
        variant: str,
        seed: int | None,
        memory: int,
        cpus: Sequence[int],
    ) -> None:
        hold_to(cpus)
        given = convert(options, WorkerOptions)
        self._shared, self._files = SharedArrays(memory), PicturesInMemory()
        self._maker = PassMaker(EmbreeCaster(), None)
        self._versions = library_versions()
        self._targets, self._drawn, self._photographs = KnownTargets(), DrawnPictures(), Photographs()
        self._path, self._variant = stage, variant
        self._readers: dict[str, StageReader] = {}
        self._edited: OrderedDict[tuple[object, ...], EditedStage] = OrderedDict()
        self._provenances: dict[str, Mapping[str, Any]] = {}
        first = self._reader(variant)
        own = first.seed if seed is None else seed
        self._options = replace(given, settings=replace(given.settings, seed=own))
        self._passes = PicturePasses(self._files, self._maker, self._options.settings)
        self._keys = KeyMaker(self._options.settings)
        content = stage_content(first)
        self.opened = OpenedSimulator(
            frames=[frame.name for frame in first.frames],
            variants=list(first.variants),
            seed=own,
            targets=content.targets,
            parts=content.parts,
        )

    def picture(self, *, request: Mapping[str, Any], kinds: Sequence[str], recorded: bool) -> MadeInMemory:
        """Make the picture's arrays of these kinds, and the record, which takes longer than some of them, if asked."""
        asked, watch = convert(request, PictureRequest), Stopwatch()
        drawn = self._draw(asked) if asked.drawn else None
        asked, variant = drawn or asked, asked.variant or self._variant
        options = self._options
        if asked.seed is not None:
            options = replace(options, settings=replace(options.settings, seed=asked.seed))
        settings = options.settings
        if RENDERED & {*kinds} and self._maker.renderer is None:
            self._maker.renderer = open_renderer(settings.renderer, device=settings.device, caster=self._maker.caster)
            self._versions |= self._maker.renderer.versions()
        scene = self._targets.in_place(self._scene(asked, variant, other_views(kinds)))
        self._passes.settings, self._keys.seed = settings, settings.seed
        of_scene = self._keys.keys(scene)
        own = own_keys(kinds, scene, of_scene.geometry, render_seed(scene, settings))
        picture = CurrentPicture(
            scene=scene, kinds=kinds, keys={**asdict(of_scene), **own}, watch=watch, recorded=recorded
        )
        self._files.arrays, self._files.recorded = {}, recorded
        files = self._passes.write_all(picture)
        made = MadeInMemory(
            frame=scene.frame.name,
            variant=variant,
            index=scene.frame.index,
            camera=RecordedCamera.of(scene.camera),
            pose=RecordedPose.of(scene.bodies[0].T_cam_body),
            arrays=self._shared.put(self._files.arrays),
            request=drawn,
        )
        if not recorded:
            return made
        if variant not in self._provenances:
            self._provenances[variant] = stage_provenance(self._reader(variant))
        record = make_record(self._provenances[variant], picture, options, files, self._versions)
        return structs.replace(made, record=encode(record).decode())

    def _scene(self, asked: PictureRequest, variant: str, views: frozenset[str]) -> Scene:
        reader = self._reader(variant)
        frame, edits = self._frame(asked), self._edits(asked)
        shown = self._edited_stage(asked).scene(frame, edits, views=views) if any(edits.names) else None
        shown = shown or reader.scene(frame, views=views)
        if BACKGROUND in asked.values:
            shown = replace(shown, environment=self._photographs.behind(Path(asked.values[BACKGROUND])))
        return shown

    def _edited_stage(self, asked: PictureRequest) -> EditedStage:
        """Return the stage in which what the request edits is edited."""
        variant, edits = asked.variant or self._variant, self._edits(asked)
        key = (variant, edits.names)
        if key not in self._edited:
            self._edited[key] = EditedStage(self._path, self._reader(variant), self._frame(asked), edits)
            if len(self._edited) > KEPT_STAGES:
                self._edited.popitem(last=False)
        self._edited.move_to_end(key)
        return self._edited[key]

    def _draw(self, asked: PictureRequest) -> PictureRequest:
        """Return the request with what it leaves to be drawn."""
        reader = self._reader(asked.variant or self._variant)

        def opened(posed: PictureRequest) -> BaseStage:
            frame = self._frame(posed)
            kept = structs.replace(posed, values={}, lights={}, parts={})
            if not any(self._edits(kept).names):
                stage = reader.stage
            else:
                edited = self._edited_stage(kept)
                edited.scene(frame, self._edits(kept))
                stage = edited.stage
            camera = stage.GetPrimAtPath(reader.camera_prim.GetPath())
            return BaseStage(stage=stage, times=(frame.time_code,), metres=reader.metres, chosen_camera=camera)

        return self._drawn.drawn(asked, reader.scene(self._frame(asked)), opened)

    def _frame(self, asked: PictureRequest) -> FrameId:
        reader = self._reader(asked.variant or self._variant)
        frame = reader.frames[0] if asked.frame is None else frame_named(reader.frames, asked.frame, self._path)
        if asked.time is not None:
            if asked.frame is not None:
                raise InputError("a frame and a time are both asked for", do="give one of them")
            frame = replace(frame, time_code=reader.clock.time_code(asked.time), time_s=asked.time, utc="")
        return replace(frame, name=asked.called, source_file="") if asked.called else frame

    def _edits(self, asked: PictureRequest) -> Edits:
        return Edits(
            poses={name: np.array(pose) for name, pose in asked.poses.items()},
            parts={name: np.array(moved) for name, moved in asked.parts.items()},
            lights=asked.lights,
            values={n: tuple(v) if isinstance(v, list) else v for n, v in asked.values.items() if n != BACKGROUND},
            selections=asked.selections,
        )

    def _reader(self, variant: str) -> StageReader:
        if variant not in self._readers:
            after = next(iter(self._readers.values()), None)
            self._readers[variant] = StageReader(self._path, variant=variant, after=after)
        return self._readers[variant]
