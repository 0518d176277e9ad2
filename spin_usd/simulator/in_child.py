"""The child's part of a simulator: a stage kept open, and pictures of it made in memory."""

from dataclasses import replace
from typing import Protocol

from msgspec import structs
from msgspec.json import encode

from spin_usd.labels.table import other_views
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.planning.in_child import stage_content
from spin_usd.processes.processors import hold_to
from spin_usd.records.record import RecordedCamera, RecordedPose, StageProvenance
from spin_usd.scene.scene import Scene
from spin_usd.simulator.calls import MadeInMemory, OpenedSimulator, OpenSimulator, SimulatePicture
from spin_usd.simulator.drawn_pictures import DrawnPictures
from spin_usd.simulator.picture_log import PictureLog, begin_log
from spin_usd.simulator.shared_arrays import SharedArrays
from spin_usd.studio.memory_sink import MemorySink
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.record import make_record
from spin_usd.studio.studio import Studio


class Scenes(Protocol):
    """The source of a picture's scene: the stage itself, or its log."""

    def scene_of(self, request: SimulatePicture, views: frozenset[str]) -> Scene:
        """Read the scene that a request shows. Raises InputError."""

    def saved(self, *, now: bool = False) -> bool:
        """Save unsaved changes if the last time is a while ago, or `now`; return whether all are saved."""


class _OfStage:
    """Scenes of the stage itself."""

    def __init__(self, stage: OpenStage) -> None:
        self._stage = stage

    def scene_of(self, request: SimulatePicture, views: frozenset[str]) -> Scene:
        return self._stage.scene(request.picture, views=views)

    def saved(self, *, now: bool = False) -> bool:
        return True


class StagePictures:
    """Pictures of a stage, made in a child process."""

    opened: OpenedSimulator

    def __init__(self, request: OpenSimulator) -> None:
        hold_to(request.cpus)
        self._shared, self._sink = SharedArrays(request.memory), MemorySink()
        path, seed = begin_log(request) if request.log else (request.stage, request.seed)
        self._stage, self._drawn = OpenStage(path, variant=request.variant), DrawnPictures()
        self._provenances: dict[str, StageProvenance] = {}
        first = self._stage.reader()
        seed = first.seed if seed is None else seed
        self._options = replace(request.options, settings=replace(request.options.settings, seed=seed))
        self._studio = Studio(self._options.settings)
        log = PictureLog(request.log, self._stage, seed) if request.log else None
        self._scenes: Scenes = log or _OfStage(self._stage)
        content = stage_content(first)
        self.opened = OpenedSimulator(
            frames=[frame.name for frame in first.frames],
            variants=list(first.variants),
            seed=seed,
            targets=content.targets,
            parts=content.parts,
            logged=log.count if log else 0,
        )

    def picture(self, request: SimulatePicture) -> MadeInMemory:
        """Make the arrays of a picture, and its record if requested."""
        watch, drawn = Stopwatch(), None
        if request.picture.drawn:
            drawn = self._drawn.drawn(request.picture, self._stage)
            request = structs.replace(request, picture=drawn)
        asked, settings = request.picture, self._options.settings
        if asked.seed is not None:
            settings = replace(settings, seed=asked.seed)
        scene = self._scenes.scene_of(request, other_views(request.kinds))
        self._sink.begin(digests=request.recorded)
        picture = self._studio.make(
            scene, request.kinds, self._sink, watch, settings=settings, recorded=request.recorded
        )
        variant, record = asked.variant or self._stage.variant, None
        if request.recorded:
            if variant not in self._provenances:
                self._provenances[variant] = self._stage.reader(variant).provenance(self._options.stage)
            made = make_record(self._provenances[variant], picture, self._options, self._studio.versions)
            record = encode(made).decode()
        return MadeInMemory(
            frame=scene.frame.name,
            variant=variant,
            index=scene.frame.index,
            camera=RecordedCamera.of(scene.camera),
            pose=RecordedPose.of(scene.bodies[0].T_cam_body),
            arrays=self._shared.put(self._sink.arrays),
            request=drawn,
            record=record,
            saved=self._scenes.saved(),
        )

    def save_log(self) -> None:
        """Write the log to disk."""
        self._scenes.saved(now=True)
