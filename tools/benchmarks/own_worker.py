"""A worker of spin_usd as a run has it: held open, it makes one picture after another with all its files."""

import shutil
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.commands.render.calls import MAKE_PICTURE, OPEN_WORKER, MakePicture, OpenWorker
from spin_usd.files.folder import FileIn, Folder
from spin_usd.formats.array_file import read_array
from spin_usd.options import PictureOptions
from spin_usd.picture.kinds import RADIANCE
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.child import Child
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.scene import Scene


class OwnWorker:
    """One worker on a stage, in a process of its own: `pid`."""

    def __init__(self, stage: Path, root: Path, settings: RenderSettings, stack: ExitStack, *, image: bool = True):
        """Start it for the dataset `root`, to end with the stack. Without `image` it makes labels alone."""
        asked = PictureOptions(stage, renderer=settings.renderer, labels_only=not image)
        request = RenderRequest(options=asked, effort=settings.effort)
        options = WorkerOptions(root=str(root), work=str(root / "work"), stage=str(stage), settings=settings)
        self._root, self._kinds = root, request.kinds
        self._child = stack.enter_context(Child(writes=(root,)))
        self._child.call(OPEN_WORKER, OpenWorker(options=options))
        self.pid = self._child.process.pid

    def picture(self, scene: Scene) -> None:
        """Make the picture of `scene`, whatever was made before."""
        shutil.rmtree(self._root / "cache", ignore_errors=True)
        self._make(scene, self._kinds)

    def radiance(self, scene: Scene) -> NDArray[np.float32]:
        """Return (rows, columns, 4) of the picture made last, linear light and coverage of its region."""
        self._make(scene, (RADIANCE,))
        found: NDArray[np.float32] = read_array(
            FileIn(Folder(self._root), f"{RADIANCE}/nominal/{scene.frame.name}.exr")
        )
        return found[scene.picture_region.slices]

    def _make(self, scene: Scene, kinds: tuple[str, ...]) -> None:
        self._child.call(MAKE_PICTURE, MakePicture(variant="nominal", index=scene.frame.index, kinds=kinds))
