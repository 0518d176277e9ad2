"""A worker: one renderer kept open, pictures made one after another, each written and recorded."""

import os
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import psutil
from numpy.typing import NDArray

from spin_usd.dataset.job import Job
from spin_usd.dataset.picture import IMAGE, RADIANCE, Stopwatch, make_picture
from spin_usd.dataset.plan import stage_provenance
from spin_usd.dataset.rendered import recorded_radiance
from spin_usd.dataset.resume import recorded_files
from spin_usd.dataset.schema import read_json
from spin_usd.dataset.store import Store, write_atomically, write_json
from spin_usd.dataset.versions import library_versions
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.formats.image_file import write_image
from spin_usd.labels.label import LABELS
from spin_usd.render.renderer import Renderer
from spin_usd.scene.keys import RenderSettings, exposure_key, geometry_key, picture_seed, radiance_key, render_seed
from spin_usd.scene.model import Scene
from spin_usd.stage.read import StageReader

WRITERS = 2  # files encoded at once: compression is most of their time, and runs outside Python's lock


class Worker:
    """Lives in a child process. `cpus`: the processors it may use (Blender's own thread limit burns a second core)."""

    def __init__(self, *, job: dict[str, Any], cpus: Sequence[int] | None = None) -> None:
        if cpus and sys.platform == "linux":
            os.sched_setaffinity(0, cpus)
        self.job = Job.from_json(job)
        self.store = Store(root=Path(self.job.root))
        self.renderer = open_renderer(self.job.settings.renderer)
        self.versions = library_versions() | self.renderer.versions()
        self._reader: StageReader | None = None

    def picture(self, *, variant: str, index: int, kinds: Sequence[str]) -> dict[str, Any]:
        """Make picture `index` of `variant`; returns the seconds spent by kind of work, the memory now used, and
        whether its radiance file served. One that fails leaves none of the files that it wrote."""
        watch = Stopwatch()
        with watch("stage"):
            reader = self.reader(variant)
            scene = reader.scene(reader.frames[index])
        before = self.withdraw(variant, scene.frame.name)
        had = recorded_files(before, variant, scene.frame.name)
        notes: dict[str, float] = {}
        with watch("radiance file"):
            known = had.get(RADIANCE) if RADIANCE in kinds else None
            rendered = recorded_radiance(self.store, before, known, scene, self.job.settings, self.versions)
        files = {} if rendered is None else {RADIANCE: before["files"][RADIANCE]}
        made = make_picture(scene, self.renderer, self.job.settings, kinds, watch, notes, rendered=rendered)
        files |= self._write_all(variant, scene.frame.name, made, watch)
        with watch("files"):
            record = make_record(reader, scene, self.job, files, self.versions, notes)
            write_json(self.store.record(variant, scene.frame.name), record)
            for stale in set(had.values()) - {entry["path"] for entry in files.values()}:
                (self.store.root / stale).unlink(missing_ok=True)
        memory = psutil.Process().memory_info().rss
        return {"seconds": watch.seconds, "memory": memory, "from_radiance": rendered is not None}

    def _write_all(
        self, variant: str, frame: str, made: Iterable[tuple[str, NDArray[Any], tuple[str, ...]]], watch: Stopwatch
    ) -> dict[str, dict[str, str]]:
        """Write each file as soon as it is `made`; returns their entries in the record. Where one fails none stays:
        without a record they would be nobody's."""
        writing: dict[str, Future[dict[str, str]]] = {}
        try:
            with ThreadPoolExecutor(max_workers=WRITERS) as writers:  # labels are written while the image is rendered
                for kind, array, channels in made:
                    writing[kind] = writers.submit(self._write, kind, variant, frame, array, channels)
                with watch("files"):
                    return {kind: written.result() for kind, written in writing.items()}
        except Exception:
            for written in writing.values():
                if written.exception() is None:
                    (self.store.root / written.result()["path"]).unlink(missing_ok=True)
            raise

    def _write(
        self, kind: str, variant: str, frame: str, array: NDArray[Any], channels: tuple[str, ...]
    ) -> dict[str, str]:
        """Write one file; returns its entry in the record."""
        path = self.store.file(kind, variant, frame, suffix_of(kind, self.job.image_suffix))
        digest = write_atomically(path, partial(write_image, array=array, channels=channels))
        return {"path": self.store.relative(path), "sha256": digest}

    def withdraw(self, variant: str, frame: str) -> dict[str, Any]:
        """Remove a picture's old record, so that none ever describes files being replaced; returns it, or {} where
        there was none."""
        path = self.store.record(variant, frame)
        try:
            record = read_json(path, "record-1")
        except InputError:
            record = {}
        path.unlink(missing_ok=True)
        return record

    def reader(self, variant: str) -> StageReader:
        """The stage in that variant. One is kept: pictures come ordered by variant."""
        if self._reader is None or self._reader.variant != variant:
            self._reader = StageReader(self.store.root / self.job.stage, variant=variant)
        return self._reader


def open_renderer(name: str) -> Renderer:
    """The renderer of that name: `blender` or `raycast`."""
    if name == "raycast":
        from spin_usd.render.raycast import RaycastRenderer

        return RaycastRenderer()
    if name == "blender":
        from spin_usd.render.blender.renderer import BlenderRenderer

        return BlenderRenderer()
    raise UnsupportedError(f"there is no renderer {name!r}", do="choose blender or raycast")


def suffix_of(kind: str, image_suffix: str) -> str:
    """The file name extension of a kind of file."""
    if kind == IMAGE:
        return image_suffix
    return ".exr" if kind == RADIANCE else LABELS[kind].suffix


def make_record(
    reader: StageReader,
    scene: Scene,
    job: Job,
    files: dict[str, Any],
    versions: dict[str, str],
    notes: dict[str, float],
) -> dict[str, Any]:
    """The picture's record, by schema record-1. `notes`: what making the picture adds to its provenance."""
    camera, pose, region = scene.camera, scene.T_cam_body, scene.picture_region
    return {
        "schema": "record-1",
        "frame": scene.frame.name,
        "index": scene.frame.index,
        "variant": reader.variant,
        "camera": {
            "width": camera.width,
            "height": camera.height,
            "fx": camera.fx,
            "fy": camera.fy,
            "cx": camera.cx,
            "cy": camera.cy,
            "distortion": list(camera.distortion),
        },
        "pose": {"q_cam_body": pose.quaternion.tolist(), "t_cam_body": pose.translation.tolist()},
        "files": files,
        "provenance": {
            "stage": {"root": job.stage, **stage_provenance(reader)},
            "keys": keys(scene, job.settings),
            "render": {
                "renderer": job.settings.renderer,
                "samples": job.settings.samples,
                "denoised": False,
                "region": [region.x0, region.y0, region.x1, region.y1],
            },
            "time_code": scene.frame.time_code,
            "seed": {
                "dataset": job.settings.seed,
                "render": render_seed(scene, job.settings),
                "picture": picture_seed(scene, job.settings),
            },
            "versions": versions,
            **notes,
        },
    }


def keys(scene: Scene, settings: RenderSettings) -> dict[str, str]:
    """The picture's three keys."""
    return {
        "geometry": geometry_key(scene, settings.renderer),
        "radiance": radiance_key(scene, settings),
        "exposure": exposure_key(scene, settings),
    }
