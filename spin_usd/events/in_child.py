"""The child's part of making events: the light of a chunk of time steps, and then the events in it."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import to_builtins
from numpy.typing import NDArray

from spin_usd.basics.arrays import digest
from spin_usd.basics.faults import decoding
from spin_usd.basics.progress import Progress, no_progress
from spin_usd.errors import InputError
from spin_usd.events.calls import ChunkMade, OpenedEvents, OpenEvents
from spin_usd.events.event_stage import EventStage
from spin_usd.events.light_frames import CHUNK, LightFrame, LightFrames, fine_region, rendered
from spin_usd.events.make_events import VERSION
from spin_usd.files.changes import remove_emptied, remove_file, remove_tree
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.formats.event_file import EventFileWriter
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.picture.render_file import RENDER_SUFFIX, encoded_render, read_render
from spin_usd.processes.processors import hold_to
from spin_usd.records.event_record import EventRecord
from spin_usd.records.record import RecordedCamera
from spin_usd.scene.derived.light_groups import UnitLight
from spin_usd.scene.passes import Radiance
from spin_usd.sensor.events import MICROSECONDS, EventMaker
from spin_usd.sensor.exposure import metered
from spin_usd.store.atomic import fill_atomically, write_atomically, write_json
from spin_usd.store.cache import RENDERS, Cache
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import EVENTS, STATE, event_chunk, event_chunks, event_record_of, events_of
from spin_usd.studio.studio import Studio


class _LostChunkError(Exception):
    """The stored data of a chunk are damaged or missing."""


class EventWorker:
    """Makes the events of a variant of a stage that lies in a dataset."""

    def __init__(self, request: OpenEvents, progress: Progress = no_progress) -> None:
        if request.cpus:
            hold_to(request.cpus)
        options, self._labelled, self._key = request.options, request.labelled, request.key
        self._settings = options.settings
        self._store, self._work = Store(root=Path(options.root)), Path(options.work)
        self._stage = EventStage(self._store.root / options.stage, variant=request.variant, pictures=request.pictures)
        self._reader, self._sensor = self._stage.reader, self._stage.sensor
        self._studio = Studio(self._settings)
        self._studio.open_renderer()
        self._cache = Cache(folder=self._store.folder, versions=self._studio.versions, work=self._work)
        self._times = self._stage.times(progress) if request.times is None else request.times
        # chunks made with other software cannot be parts
        self._chunk_key = digest([request.key, self._studio.versions])
        self._exposure = self._metered() if request.exposure is None else request.exposure
        self._frames: list[LightFrame] = []
        self._renders = 0

    @property
    def opened(self) -> OpenedEvents:
        """The steps, and the place of their chunks."""
        chunks = -(-(len(self._times) - 1) // CHUNK)
        return OpenedEvents(times=self._times, chunks=chunks, chunk_key=self._chunk_key, exposure=self._exposure)

    def light(self, chunk: int, progress: Progress) -> ChunkMade:
        """Make the light of all steps of a chunk."""
        start = chunk * CHUNK
        times = self._times[start : start + CHUNK + 1]
        at = partial(self._stage.scene, progress)
        sensor = replace(self._sensor, dark=self._sensor.dark / self._exposure)  # for light before exposure
        made = LightFrames(
            at, times, self._studio.maker, self._rendered, self._settings, sensor, labelled=self._labelled
        )
        self._frames = list(made.frames())
        self._renders = made.rendered
        return ChunkMade()

    def events(self, chunk: int) -> ChunkMade:
        """Make the events of the chunk whose light was made, after the events of the chunk before. The state that the
        next chunk starts from is stored with them; if the state of the chunk before is damaged or missing, all chunks
        are removed."""
        frames, exposure = self._frames, np.float32(self._exposure)
        maker = EventMaker(self._sensor, frames[0].light.shape, seed=self._seed)
        if chunk:
            try:
                maker.resume(self._read(STATE, chunk - 1))
            except _LostChunkError:
                return self._forget()
            frames = frames[1:]
        made = [maker.events(frame.light * exposure, frame.seconds, frame.labels) for frame in frames]
        if chunk == self.opened.chunks - 1:
            made.append(maker.rest())
        events = np.concatenate(made)
        events["t"] = np.maximum(events["t"], round(self._times[0] * MICROSECONDS))  # jitter may go below that
        poses = np.array([[body.T_cam_body.matrix for body in frame.scene.targets] for frame in frames])
        times = np.array([frame.seconds for frame in frames])
        made_by = {"poses": poses, "times": times, "renders": np.array(self._renders)}
        self._write(EVENTS, chunk, {"events": events, **made_by})
        self._write(STATE, chunk, maker.state)
        if chunk:
            self._remove(STATE, chunk - 1)
        self._frames = []
        return ChunkMade()

    def finish(self, _: int) -> ChunkMade:
        """Put the events of all chunks into the variant's file, and write its record. If a chunk is damaged or missing,
        all chunks are removed."""
        scene, variant = self._stage.scene(no_progress, self._times[0]), self._reader.variant
        chunks, start = range(self.opened.chunks), round(self._times[0] * MICROSECONDS)
        name, count, renders = events_of(variant), 0, 0

        def fill(path: Path) -> None:
            nonlocal count, renders
            width, height = scene.camera.width, scene.camera.height
            times, poses = [], []
            with EventFileWriter(
                path, width=width, height=height, variant=variant, start_us=start, labelled=self._labelled
            ) as file:
                for chunk in chunks:
                    made = self._read(EVENTS, chunk)
                    file.append(made["events"])
                    times.append(made["times"])
                    poses.append(made["poses"])
                    count, renders = count + len(made["events"]), renders + int(made["renders"])
                file.finish(
                    round(self._times[-1] * MICROSECONDS) - start,
                    np.rint(np.concatenate(times) * MICROSECONDS).astype(np.int64),
                    np.concatenate(poses),
                    [body.target.name for body in scene.targets],
                )

        try:
            fill_atomically(self._store.folder, name, fill, work=self._work)
        except _LostChunkError:
            return self._forget()
        record = EventRecord(
            variant=variant,
            file=name,
            sha256=self._store.folder.sha256(name),
            key=self._key,
            events=count,
            start=self._times[0],
            duration=self._times[-1] - self._times[0],
            steps=len(self._times),
            renders=renders,
            labelled=self._labelled,
            sensor=asdict(self._sensor),
            exposure=scene.sensor.exposure * self._exposure,
            camera=RecordedCamera.of(scene.camera),
            stage=self._reader.stage_hash,
            settings=to_builtins(self._settings),
            versions=self._studio.versions,
        )
        write_json(self._store.folder, event_record_of(variant), to_builtins(record), work=self._work)
        for chunk in chunks:
            self._remove(EVENTS, chunk)
        self._remove(STATE, chunks[-1])
        return ChunkMade()

    @property
    def _seed(self) -> int:
        return int(digest([self._settings.seed, self._reader.variant, EVENTS])[:8], 16)

    def _rendered(self, light: UnitLight, fine: int) -> Radiance:
        """Return a render from the dataset's cache, or make it and store it there."""
        scene = light.scene
        key = digest([VERSION, self._studio.keys(scene).radiance, fine])
        entry = self._cache.find(RENDERS, key)
        groups = len(light.gains)
        found = read_render(entry.file, fine_region(scene, fine), groups=groups) if entry else None
        if found is None:
            found = rendered(light, fine, self._studio.maker, self._settings)
            self._cache.keep(RENDERS, key, RENDER_SUFFIX, partial(encoded_render, found))
        return found

    def _metered(self) -> float:
        """Return the factor of an automatic exposure, which the first step decides for all."""
        scene = self._stage.scene(no_progress, self._times[0])
        if scene.sensor.auto_exposure is None:
            return 1.0
        light = self._studio.maker.radiance(scene, self._settings, Stopwatch())
        return metered(scene.sensor, light)

    def _read(self, what: str, chunk: int) -> dict[str, NDArray[Any]]:
        name = event_chunk(self._chunk_key, what, chunk)
        try:
            with self._store.folder.open(name, MAX_ARRAY) as file, decoding(name):
                return dict(np.load(file, allow_pickle=False))
        except InputError as error:
            raise _LostChunkError from error

    def _forget(self) -> ChunkMade:
        remove_tree(self._store.folder, event_chunks(self._chunk_key))
        self._frames = []
        return ChunkMade(lost=True)

    def _write(self, what: str, chunk: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        def encoded() -> bytes:
            file = BytesIO()
            np.savez(file, allow_pickle=False, **arrays)
            return file.getvalue()

        name = event_chunk(self._chunk_key, what, chunk)
        write_atomically(self._store.folder, name, encoded, work=self._work, forced=False)

    def _remove(self, what: str, chunk: int) -> None:
        name = event_chunk(self._chunk_key, what, chunk)
        remove_file(self._store.folder, name)
        remove_emptied(self._store.folder, name)
