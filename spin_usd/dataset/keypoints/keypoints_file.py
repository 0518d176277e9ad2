"""The layer that the keypoint tool goes on with and saves into: whole at every moment, whatever ends the process."""

from pathlib import Path

import numpy as np

from spin_usd.dataset.process.lasting_child import LastingChild
from spin_usd.dataset.store.atomic import write_text
from spin_usd.dataset.store.hidden_folder import hidden_folder
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.scene.source.keypoints import Keypoints

SUFFIX = ".usda"
MAX_BYTES = 1 << 24


class KeypointsFile:
    """The layer at `path` with the keypoints of the target of that name; `child` reads it and makes its text."""

    def __init__(self, path: Path, target: str, child: LastingChild) -> None:
        """Raises InputError unless `path` can be the name of a layer of text."""
        if path.suffix.lower() != SUFFIX:
            raise InputError("is not the name of a layer of text", where=path, do=f"give a name that ends in {SUFFIX}")
        self.path, self._target, self._child = path, target, child
        self._folder = Folder(path.absolute().parent)
        self._known: bytes | None = None

    def read(self) -> Keypoints | None:
        """Read the keypoints; None where there is no such file. Raises InputError and StageError for another file."""
        self._known = self._bytes()
        if self._known is None:
            return None
        read = self._child.read("read_keypoints", reads=self.path, path=str(self.path))
        return Keypoints(names=tuple(read["names"]), points=np.array(read["points"], np.float64).reshape(-1, 3))

    def write(self, keypoints: Keypoints) -> None:
        """Write the keypoints in place of what is there. Raises OutputError, and InputError where another program has
        written it since it was read, and leaves it then as it was."""
        if self._bytes() not in (None, self._known):
            do = "end this tool and start it again, or move that file elsewhere"
            raise InputError("was changed by another program", where=self.path, do=do)
        names, points = list(keypoints.names), keypoints.points.tolist()
        text = self._child.read("keypoints_text", reads=self.path, names=names, points=points, target=self._target)
        with hidden_folder(self.path.absolute().parent, self.path.name) as hidden:
            write_text(self._folder, self.path.name, text, work=hidden.folder)
        self._known = text.encode()

    def _bytes(self) -> bytes | None:
        """Return what is in the file; None where there is none."""
        if self._folder.type_of(self.path.name) is None:
            return None
        return self._folder.read(self.path.name, MAX_BYTES)
