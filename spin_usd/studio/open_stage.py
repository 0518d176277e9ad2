"""A stage kept open: its scenes as they are, or with the changes of a request."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from spin_usd.errors import InputError
from spin_usd.scene.derived.known_targets import KnownTargets
from spin_usd.scene.environment import BACKGROUND, Environment
from spin_usd.scene.scene import NOMINAL, FrameId, Scene
from spin_usd.stage.augment.attribute_change import BaseStage
from spin_usd.stage.augment.background import photograph
from spin_usd.stage.augment.edited_stage import EditedStage, Edits
from spin_usd.stage.read.frames import frame_named
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.studio.picture_request import PictureRequest
from spin_usd.studio.recently_used import RecentlyUsed

KEPT = 8  # readers of other variants, and stages opened for the same edits


class OpenStage:
    """The stage at `path`, shown in `variant` unless a request names another. `check_images`: as for StageReader;
    `kept`: number of variants that stay open."""

    def __init__(
        self, path: str | Path, *, variant: str = NOMINAL, check_images: bool = True, kept: int = KEPT
    ) -> None:
        self.path, self.variant, self._check_images = path, variant, check_images
        self._readers = RecentlyUsed[StageReader](kept)
        self._edited = RecentlyUsed[EditedStage](KEPT)
        self._last: StageReader | None = None
        self._targets, self._photographs = KnownTargets(), Photographs()

    def reader(self, variant: str | None = None) -> StageReader:
        """Return the reader of a variant, the stage's own if not given."""
        variant = variant or self.variant
        found = self._readers.find(variant)
        if found is None:
            found = StageReader(self.path, variant=variant, after=self._last, check_images=self._check_images)
            self._readers.keep(variant, found)
        self._last = found
        return found

    def has(self, variant: str) -> bool:
        """Return whether the variant is open."""
        return self._readers.find(variant) is not None

    def frame(self, request: PictureRequest) -> FrameId:
        """Return the frame of a request. Raises InputError if there is none."""
        reader = self.reader(request.variant)
        frame = reader.frames[0] if request.frame is None else frame_named(reader.frames, request.frame, self.path)
        if request.time is not None:
            if request.frame is not None:
                raise InputError("a frame and a time are both given", do="give one of them")
            reader.clock.refuse_outside(request.time, self.path)
            code = reader.clock.time_code(request.time)
            frame = replace(frame, time_code=code, time_s=request.time, utc="")
        return replace(frame, name=request.called, source_file="") if request.called else frame

    def scene(self, request: PictureRequest, *, views: frozenset[str] = frozenset()) -> Scene:
        """Read the scene of a request. Raises InputError for anything that the stage does not have."""
        frame, edits = self.frame(request), edits_of(request)
        if any(edits.names):
            scene = self.edited(request.variant, frame, edits).scene(frame, edits, views=views)
        else:
            scene = self.reader(request.variant).scene(frame, views=views)
        return self.finished(scene, request.values.get(BACKGROUND))

    def finished(self, scene: Scene, photograph: str | Path | None) -> Scene:
        """Return the scene with the targets of the scene before if they are equal, and a photograph behind, if any."""
        scene = self._targets.in_place(scene)
        if photograph is None:
            return scene
        return replace(scene, environment=self._photographs.behind(Path(photograph)))

    def edited(self, variant: str | None, frame: FrameId, edits: Edits) -> EditedStage:
        """Return the stage opened for edits like these; `frame`: one of its frames."""
        variant = variant or self.variant
        key = (variant, edits.names)
        found = self._edited.find(key)
        if found is None:
            found = EditedStage(self.path, self.reader(variant), frame, edits)
            self._edited.keep(key, found)
        return found

    def base(self, request: PictureRequest) -> BaseStage:
        """Return the stage with the poses and selections of a request, to draw the rest on."""
        reader, frame = self.reader(request.variant), self.frame(request)
        edits = replace(edits_of(request), values={}, lights={}, parts={})
        stage = reader.stage
        if any(edits.names):
            edited = self.edited(request.variant, frame, edits)
            edited.scene(frame, edits)
            stage = edited.stage
        camera = stage.GetPrimAtPath(reader.camera_prim.GetPath())
        return BaseStage(stage=stage, times=(frame.time_code,), metres=reader.metres, chosen_camera=camera)


class Photographs:
    """Photographs behind pictures, each opened once."""

    def __init__(self) -> None:
        self._known: dict[Path, Environment] = {}

    def behind(self, file: Path) -> Environment:
        """Return the photograph in the file as surroundings. Raises InputError."""
        if file not in self._known:
            self._known[file] = Environment(back_plate=photograph(file))
        return self._known[file]


def edits_of(request: PictureRequest) -> Edits:
    """Return the edits of a request."""
    return Edits(
        poses={name: np.array(pose) for name, pose in request.poses.items()},
        parts={name: np.array(moved) for name, moved in request.parts.items()},
        lights=request.lights,
        values={n: tuple(v) if isinstance(v, list) else v for n, v in request.values.items() if n != BACKGROUND},
        selections=request.selections,
    )
