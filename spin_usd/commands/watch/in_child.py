"""The child's part of `watch`: it reads the stage anew, and makes the pictures of one frame small and at once."""

import gc
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from numpy.typing import NDArray

from spin_usd.basics.faults import expected
from spin_usd.commands.watch.request import FileStates, OpenViewer, SeenPicture, StageView, ViewStage, states_of
from spin_usd.errors import SpinError, UnknownPictureError
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.image_file import write_image
from spin_usd.labels import preview
from spin_usd.labels.table import DEFAULT_LABELS, PIXEL_LABELS
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.renderers.background.sky import sky
from spin_usd.renderers.downscale import reduced
from spin_usd.scene.content import key_of
from spin_usd.scene.derived.content_keys import RenderSettings, background_seed, picture_seed
from spin_usd.scene.derived.known_targets import KnownTargets
from spin_usd.scene.effort import REDUCTIONS
from spin_usd.scene.finding import in_sentences
from spin_usd.scene.scene import Scene
from spin_usd.sensor.develop import develop
from spin_usd.stage.composition.files import EXTENSIONS, files_of
from spin_usd.stage.composition.images import Decoded
from spin_usd.stage.read.frames import frame_named
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.studio.studio import Studio

MAX_LAYERS = 1000  # watched at most, if the stage's files are unknown


class Viewer:
    """A viewer that lives in a child process. It keeps everything that an edit does not change: decoded images, equal
    targets, their background; so the renderers' data for these stay too."""

    def __init__(self, request: OpenViewer) -> None:
        self._settings = RenderSettings(renderer=request.renderer, effort=request.effort, seed=0)
        studio = Studio(self._settings)
        studio.open_renderer()
        self._maker = studio.maker
        self._states: FileStates = {}
        self._images: dict[tuple[str, str], Decoded] = {}
        self._targets = KnownTargets()
        self._behind: tuple[str, NDArray[Any] | None] = ("", None)

    def view(self, request: ViewStage) -> StageView:
        """Look at the picture."""
        gc.collect()  # else USD would show the old layers of the stage again
        states = states_of(_files(request.stage))
        self._images = {key: image for key, image in self._images.items() if self._is_unchanged(key[0], states)}
        self._states = states
        try:
            seen = self._seen(request)
        except Exception as fault:
            error = expected(fault, request.stage)
            if error is None:
                raise
            return StageView(files=states, fault=str(error), unknown=isinstance(error, UnknownPictureError))
        return StageView(files=states, seen=seen)

    def _is_unchanged(self, image: str, states: FileStates) -> bool:
        """Return whether the file that holds the image, alone or in a package, is unchanged."""
        file = image.partition("[")[0]
        return states.get(file) is not None and states[file] == self._states.get(file)

    def _seen(self, request: ViewStage) -> SeenPicture:
        reader = StageReader(request.stage, variant=request.variant, images=self._images)
        chosen = frame_named(reader.frames, request.frame, request.stage)
        scene = _small(self._targets.in_place(reader.scene(chosen)), request.max_width)
        self._images = reader.decoded_images
        pictures = dict(self._labels(scene)) if request.labels else {}
        pictures[IMAGE] = _png(preview.image(self._image(scene, reader.seed)))
        return SeenPicture(
            frame=chosen.name,
            place=chosen.index,
            frames=len(reader.frames),
            variants=tuple(reader.variants),
            notes=tuple(in_sentences(reader.notes)),
            pictures=pictures,
        )

    def _labels(self, scene: Scene) -> Iterator[tuple[str, bytes]]:
        for name, array, _ in self._maker.labels(scene, DEFAULT_LABELS, self._settings, Stopwatch()):
            yield name, _png(PIXEL_LABELS[name].preview(array))

    def _image(self, scene: Scene, seed: int) -> NDArray[Any]:
        settings = replace(self._settings, seed=seed)
        radiance = self._maker.radiance(scene, settings, Stopwatch())
        behind = self._sky(scene, background_seed(scene, settings))
        return develop(scene, radiance, behind, seed=picture_seed(scene, settings))

    def _sky(self, scene: Scene, seed: int) -> NDArray[Any] | None:
        """Return the background; the one of the view before if lights, surroundings and camera are the same."""
        key = key_of([scene.lights, scene.environment, scene.camera, seed])
        if key != self._behind[0]:
            self._behind = key, sky(scene, seed=seed)
        return self._behind[1]


def _files(stage: str) -> list[str]:
    """Return the paths of the stage's files, also of missing ones; if the stage does not list them, of the layers below
    its folder."""
    try:
        files = files_of(stage)
    except SpinError:
        folder = Folder(Path(stage).parent)
        layers = (str(folder.root / name) for name in folder.files() if name.lower().endswith(EXTENSIONS))
        return [stage, *islice(layers, MAX_LAYERS)]
    return [str(path) for path in (*files.found, *(each.layer.parent / each.name for each in files.missing))]


def _small(scene: Scene, max_width: int) -> Scene:
    """Return the scene as a detector of fewer, larger pixels sees it, `max_width` or fewer in a row if possible."""
    by = next((by for by in REDUCTIONS if scene.camera.width <= by * max_width), REDUCTIONS[-1])
    blur = {name: getattr(scene.optics, name) / by for name in ("psf_sigma", "glare_core")}
    return replace(reduced(scene, by), optics=replace(scene.optics, **blur))


def _png(picture: NDArray[Any]) -> bytes:
    with TemporaryDirectory() as folder:
        file = Path(folder, "picture.png")
        write_image(file, picture, channels=("R", "G", "B"))
        return read_bytes(file, MAX_ARRAY)
