"""The log of a simulator: each requested picture becomes a frame of a stage, and is read from there."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from msgspec import structs

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.scene.scene import FrameId, Scene
from spin_usd.simulator.calls import OpenLog, OpenSimulator, SimulatePicture
from spin_usd.stage.augment.logged_stage import ROOT, LoggedStage, logged_seed, start_log
from spin_usd.store.lock import create_lock, new_token, take_lock
from spin_usd.studio.open_stage import OpenStage, edits_of
from spin_usd.studio.picture_request import PictureRequest

LOCK = "log.lock"


def begin_log(request: OpenSimulator) -> tuple[str, int | None]:
    """Begin the log, or continue an existing one; return the root layer of its copy of the stage, and the seed.
    Raises InputError where its folder holds something else, or another simulator writes it."""
    assert request.log
    folder, there = Path(request.log.folder), Folder(Path(request.log.folder))
    if there.type_of(ROOT) is None and any(there.files()):
        do = "give a new folder, or the one of a log"
        raise InputError("is not empty, and contains no log", where=folder, do=do)
    copied = start_log(Path(request.stage), folder, variant=request.variant, seed=request.seed)
    with suppress(FileExistsError):
        create_lock(folder / LOCK, new_token())
    if take_lock(folder / LOCK) is None:  # it is held until this process ends
        raise InputError("is the log of another simulator now", where=folder, do="end that one, or begin another log")
    kept = logged_seed(folder)
    return str(copied), request.seed if kept is None else kept


class PictureLog:
    """Scenes of a stage that are read from its log."""

    def __init__(self, log: OpenLog, stage: OpenStage, seed: int) -> None:
        self._stage = stage
        self._log = LoggedStage(Path(log.folder), stage.reader(), seed=seed, parts=log.parts)
        for number, request in log.redo:
            if number >= self._log.count:
                self._log.write(number, self._frame(request, number), edits_of(request))

    @property
    def count(self) -> int:
        """Number of pictures in the log."""
        return self._log.count

    def scene_of(self, request: SimulatePicture, views: frozenset[str]) -> Scene:
        """Read the scene of a picture from the log; write it there first if it is new."""
        asked, number = request.picture, request.number
        assert number is not None
        if asked.variant is not None or asked.seed is not None:
            raise InputError("a log has one variant and one seed", do="leave them out, or begin another log")
        if asked.selections:
            raise InputError("a log has one selection of variants", do="draw from augmentations that select none")
        if "next_frame" in views:
            raise InputError("the next picture is not known yet", do="leave out labels such as flow")
        frame = self._frame(asked, number)
        if number < self._log.count:
            scene = self._log.again(number, frame, views=views)
        else:
            scene = self._log.scene(number, frame, edits_of(asked), views=views)
        return self._stage.finished(scene, None)

    def saved(self, *, now: bool = False) -> bool:
        """Write the log to disk if the last time is a while ago, or `now`; return whether all of it is there."""
        return self._log.saved(now=now)

    def _frame(self, asked: PictureRequest, number: int) -> FrameId:
        """Return the frame of a request, named by the request, else by its number. A pose of its own has no frame's
        time."""
        frame = self._stage.frame(structs.replace(asked, name=asked.name or f"request_{number:06d}"))
        own = asked.poses and asked.frame is None and asked.time is None
        return replace(frame, time_s=None, utc="") if own else frame
