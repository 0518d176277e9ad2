"""`spin-usd keypoints`: serves the tool until it is stopped."""

import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from spin_usd.basics.extras import EXTRAS
from spin_usd.basics.pluralise import pluralise
from spin_usd.basics.stop_signals import Stopped
from spin_usd.commands.keypoints.calls import (
    KEYPOINTS_TEXT,
    READ_KEYPOINTS,
    SAVE_TARGET,
    KeypointsLayer,
    PlacedKeypoints,
    SaveTarget,
)
from spin_usd.commands.keypoints.edits import table_lines
from spin_usd.commands.keypoints.options import KeypointsOptions
from spin_usd.commands.keypoints.pictures import Pictures
from spin_usd.commands.keypoints.session import Session
from spin_usd.commands.keypoints.shown_target import ShownTarget
from spin_usd.errors import InputError, SpinError
from spin_usd.files.folder import Folder
from spin_usd.processes.ask_child import ask_child
from spin_usd.processes.child_ahead import next_child
from spin_usd.processes.executor import Executor
from spin_usd.scene.keypoints import Keypoints
from spin_usd.store.atomic import write_text
from spin_usd.store.hidden_folder import hidden_folder

SUFFIX = ".usda"
MAX_BYTES = 1 << 24


class KeypointsFile:
    """The layer at `path` with the keypoints of the target of that name; `child` reads it and makes its text."""

    def __init__(self, path: Path, target: str, child: Executor[None]) -> None:
        """Raises InputError unless `path` can be the name of a layer of text."""
        if path.suffix.lower() != SUFFIX:
            raise InputError("is not the name of a layer of text", where=path, do=f"give a name that ends in {SUFFIX}")
        self.path, self._target, self._child = path, target, child
        self._folder = Folder(path.absolute().parent)
        self._known: bytes | None = None

    def read(self) -> Keypoints | None:
        """Read the keypoints; None if there is no such file. Raises InputError and StageError for another file."""
        self._known = self._bytes()
        if self._known is None:
            return None
        read = self._child.call(READ_KEYPOINTS, str(self.path), reads=self.path)
        return Keypoints(names=read.names, points=np.array(read.points, np.float64).reshape(-1, 3))

    def write(self, keypoints: Keypoints) -> None:
        """Replace the keypoints in the file. Raises OutputError, and InputError, without writing, if another program
        has written it since it was read."""
        if self._bytes() not in (None, self._known):
            do = "end this tool and start it again, or move that file elsewhere"
            raise InputError("was changed by another program", where=self.path, do=do)
        placed = PlacedKeypoints(names=keypoints.names, points=tuple(map(tuple, keypoints.points.tolist())))
        layer = KeypointsLayer(keypoints=placed, target=self._target)
        text = self._child.call(KEYPOINTS_TEXT, layer, reads=self.path)
        with hidden_folder(self.path.absolute().parent, self.path.name) as hidden:
            write_text(self._folder, self.path.name, text, work=hidden.folder)
        self._known = text.encode()

    def _bytes(self) -> bytes | None:
        """Return the file's contents; None if it does not exist."""
        if self._folder.type_of(self.path.name) is None:
            return None
        return self._folder.read(self.path.name, MAX_BYTES)


def pick_keypoints(request: KeypointsOptions, *, tell: Callable[[str], None]) -> Session:
    """Serve the tool until a signal stops it, and return the session as it ended. `tell` takes lines for the user.
    Raises InputError if the target cannot be shown or the address is not available, OutputError if keypoints cannot be
    saved, MissingPackageError without viser."""
    EXTRAS["browser"].require()
    with Executor[None](lambda _: next_child(KEYPOINTS_TEXT)) as child:
        child.start()
        session = open_session(request, child, tell)
        pictures = None if request.pictures is None else Pictures(request.pictures, session.target, child)
        if pictures and pictures.note:
            tell(f"note: {pictures.note}")
        _serve(request, session, pictures, tell)
        with session.lock:  # a change that is being saved is saved
            if session.unsaved:
                _save_at_last(session, tell)
    return session


def _save_at_last(session: Session, tell: Callable[[str], None]) -> None:
    """Save unsaved keypoints. If that fails again, print the keypoints, and raise the error."""
    try:
        session.save()
    except SpinError:
        tell("the keypoints are not saved; put these lines into a .csv file for author --keypoints:")
        for line in table_lines(session.keypoints):
            tell(line)
        raise


def _serve(request: KeypointsOptions, session: Session, pictures: Pictures | None, tell: Callable[[str], None]) -> None:
    """Serve the session until a signal stops it."""
    saved = f"every change is saved in {session.saved_in} at once"
    with _served(request, session, pictures) as address, suppress(Stopped):
        tell(f"{address}   (open it in a browser; Ctrl-C ends, and {saved})")
        threading.Event().wait()


def open_session(request: KeypointsOptions, child: Executor[None], tell: Callable[[str], None]) -> Session:
    """Read the target, and existing keypoints through the `child`, which also makes the layer to save."""
    target = _read_target(request)
    file = KeypointsFile(request.out or Path(f"{target.body.name}_keypoints.usda"), target.body.name, child)
    saved = file.read()
    for note in target.notes:
        tell(f"note: {note}")
    own = Keypoints(names=target.body.keypoint_names, points=target.body.keypoints)
    tell(_beginning(target, own, saved, file))
    if saved is None:
        file.write(own)
    return Session(target, own if saved is None else saved, file.write, str(file.path))


def _read_target(request: KeypointsOptions) -> ShownTarget:
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        asked = SaveTarget(
            target=request.target,
            folder=folder,
            units_per_metre=request.units_per_metre,
            prim=request.prim,
            any_size=request.any_size,
        )
        read = ask_child(SAVE_TARGET, asked, reads=request.target, writes=(Path(folder),))
        return ShownTarget.of(read, Path(folder, "target.npz"))


def _beginning(target: ShownTarget, own: Keypoints, saved: Keypoints | None, file: KeypointsFile) -> str:
    """Return a line on the target and the keypoints that the tool begins with."""
    size = " x ".join(f"{edge:.4g}" for edge in np.ptp(target.mesh.hull, axis=0))
    if saved is not None:
        begins = f"continues with {pluralise(len(saved.names), 'keypoint')} of {file.path}"
    else:
        begins = (
            f"begins with {pluralise(len(own.names), 'keypoint')} of the model" if own.names else "begins with none"
        )
    return f"{target.body.name}: {target.mesh.count} triangles, {size} m; {begins}"


@contextmanager
def _served(request: KeypointsOptions, session: Session, pictures: Pictures | None) -> Iterator[str]:
    """Serve the session, and give the address of its page."""
    from spin_usd.commands.keypoints.guarded_server import guarded_server
    from spin_usd.commands.keypoints.panel import Panel, PicturesPanel
    from spin_usd.commands.keypoints.target_view import TargetView

    with guarded_server(request.host, request.port, "spin-usd keypoints") as server:
        view = TargetView(server, session)
        shown: list[TargetView | Panel | PicturesPanel] = [view, Panel(server, session, view)]
        if pictures is not None:
            shown.append(PicturesPanel(server, session, pictures))

        def refresh() -> None:
            for each in shown:
                each.refresh()

        session.on_change = refresh
        with session.lock:
            refresh()
        host = f"[{request.host}]" if ":" in request.host else request.host
        yield f"http://{host}:{server.get_port()}/"
