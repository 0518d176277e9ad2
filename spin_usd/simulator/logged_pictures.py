"""The child's part of a simulator that logs what it is asked for."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from msgspec import convert, structs

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.scene.scene import FrameId, Scene
from spin_usd.simulator.in_child import StagePictures
from spin_usd.simulator.picture_request import MadeInMemory, PictureRequest
from spin_usd.stage.augment.logged_stage import ROOT, LoggedStage, logged_seed, start_log
from spin_usd.store.lock import create_lock, new_token, take_lock

LOCK = "log.lock"


class LoggedPictures(StagePictures):
    """Pictures of a stage that are read from their log. `log`: its folder; `parts`: those that may be moved; `redo`:
    numbers and requests that were made before, of which it lacks the last that were not saved; the rest as
    StagePictures has it."""

    def __init__(
        self,
        *,
        stage: str,
        variant: str,
        seed: int | None,
        log: str,
        parts: Sequence[str],
        redo: Sequence[tuple[int, Mapping[str, Any]]],
        **opened: Any,
    ) -> None:
        folder, there = Path(log), Folder(Path(log))
        if there.type_of(ROOT) is None and any(there.files()):
            raise InputError("is not empty, and holds no log", where=log, do="give a new folder, or the one of a log")
        copied = start_log(Path(stage), folder, variant=variant, seed=seed)
        with suppress(FileExistsError):
            create_lock(folder / LOCK, new_token())
        if take_lock(folder / LOCK) is None:  # it is held until this process ends
            raise InputError("is the log of another simulator now", where=log, do="end that one, or begin another log")
        kept = logged_seed(folder)
        super().__init__(stage=str(copied), variant=variant, seed=seed if kept is None else kept, **opened)
        reader = self._reader(self._variant)
        self._log = LoggedStage(folder, reader, seed=self._options.settings.seed, parts=parts)
        self._number = 0
        for number, request in redo:
            if number >= self._log.count:
                asked = convert(request, PictureRequest)
                self._log.write(number, self._named(asked, number), self._edits(asked))
        self.opened = structs.replace(self.opened, logged=self._log.count)

    def picture(self, *, number: int = -1, **asked: Any) -> MadeInMemory:
        """Make picture `number` of the log, as StagePictures does, and log it where it is not there yet."""
        self._number = number
        return structs.replace(super().picture(**asked), saved=self._log.saved())

    def save(self) -> None:
        """Write the log to disk."""
        self._log.saved(now=True)

    def _scene(self, asked: PictureRequest, variant: str, views: frozenset[str]) -> Scene:
        if asked.variant is not None or asked.seed is not None:
            raise InputError("a log has one variant and one seed", do="leave them out, or begin another log")
        if asked.selections:
            raise InputError("a log has one selection of variants", do="draw from augmentations that select none")
        if "next_frame" in views:
            raise InputError("what comes after is not known yet", do="leave out labels such as flow")
        frame = self._named(asked, self._number)
        if self._number < self._log.count:
            return self._log.again(self._number, frame, views=views)
        return self._log.scene(self._number, frame, self._edits(asked), views=views)

    def _named(self, asked: PictureRequest, number: int) -> FrameId:
        """Return the frame that is shown under the name of picture `number`."""
        return self._frame(structs.replace(asked, name=asked.name or f"request_{number:06d}"))
