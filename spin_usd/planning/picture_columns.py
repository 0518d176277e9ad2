"""The pictures of a variant as columns: each with its keys, its extent and its costs."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.identity_memo import IdentityMemo
from spin_usd.errors import UnsupportedError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.directions import half_sphere
from spin_usd.geometry.transform import Transform
from spin_usd.labels.table import other_views, own_keys
from spin_usd.planning.columns import COLUMNS
from spin_usd.planning.skipped_counts import SkippedWorkCounter
from spin_usd.planning.work import features
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.coincidence import evenly_spread
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings, render_seed
from spin_usd.scene.derived.faces import corners_of
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.derived.views import ViewCollector
from spin_usd.scene.scene import OneBody, Scene
from spin_usd.scene.sensor import Sensor
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd import schema

PROGRESS_EVERY = 100


class Features:
    """The features of pictures that cost time, and how many groups their lights make."""

    def __init__(self) -> None:
        self._last = IdentityMemo[tuple[list[str], int]]()

    def of(self, scene: Scene) -> tuple[list[str], int]:
        """Return the names of work.features, and the number of light groups."""
        shapes = (body.target for body in scene.bodies)
        of = (scene.lights, scene.environment, scene.optics, scene.sensor, *shapes)
        return self._last.of(of, lambda: (features(scene), LightGroups.of(scene).count))


class Extents:
    """The extents that each picture's target covers; variants with the same geometry and sharpness share them."""

    def __init__(self) -> None:
        self._known: dict[str, list[int]] = {}
        self._coverage = Coverage()

    def of(self, scene: Scene, geometry: str) -> list[int]:
        """Return columns and rows x0, y0, x1, y1 of the picture of `scene`, whose geometry key is given, and its
        approximate number of pixels that show the target."""
        if not scene.blurred and geometry in self._known:
            return self._known[geometry]
        region, target = scene.picture_region, round(self._coverage.target_pixels(scene))
        found = [region.x0, region.y0, region.x1, region.y1, target]
        if not scene.blurred:
            self._known[geometry] = found
        return found


class PicturePlanner:
    """Plans the pictures of one variant after the other; values shared by several are computed once."""

    def __init__(
        self,
        settings: RenderSettings,
        image_suffix: str | None,
        labels: Sequence[str],
        counter: SkippedWorkCounter | None,
        *,
        renders: bool,
        keep_poses: bool,
    ) -> None:
        self._lit = renders or counter is not None  # features that cost time in a render
        self._settings, self._image_suffix, self._labels, self._counter = settings, image_suffix, labels, counter
        self._keys = KeyMaker(settings, keep_poses=keep_poses)
        self._extents, self._features = Extents(), Features()
        self._checked: Sensor | None = None

    def columns(
        self, reader: StageReader, chosen: Sequence[int], views: ViewCollector, progress: Callable[[int], None]
    ) -> dict[str, list[Any]]:
        """Return the columns of a variant's pictures, by the names of COLUMNS; an `extent` comes from Extents."""
        views_taken = other_views(self._labels)
        columns: dict[str, list[Any]] = {name: [] for name in COLUMNS}
        for done, frame in enumerate((reader.frames[place] for place in chosen), 1):
            scene = reader.scene(frame, views=views_taken)
            if self._image_suffix and scene.sensor is not self._checked:
                self._checked = scene.sensor
                _check_bit_depth(reader, scene, self._image_suffix)
            views.add(scene)
            for name, value in zip(COLUMNS, self._row(scene), strict=True):
                columns[name].append(value)
            if done % PROGRESS_EVERY == 0:
                progress(done)
        progress(len(chosen))
        return columns

    def _row(self, scene: Scene) -> tuple[Any, ...]:
        """Return the picture of `scene`, in the order of COLUMNS."""
        frame, keys = scene.frame, self._keys.keys(scene)
        extent = self._extents.of(scene, keys.geometry)
        has, groups = self._features.of(scene) if self._lit else ([], 0)
        if self._counter:
            self._counter.add(scene, keys.radiance, has)
        seed = render_seed(scene, self._settings) if scene.lidar else 0
        return (
            frame.index,
            frame.name,
            frame.time_code,
            keys.geometry,
            keys.radiance,
            keys.exposure,
            keys.targets,
            extent,
            groups,
            has,
            frame.stated,
            own_keys(self._labels, scene, keys.geometry, seed),
        )


def _check_bit_depth(reader: StageReader, scene: Scene, image_suffix: str) -> None:
    """Raise UnsupportedError where image files of that kind cannot hold the sensor's numbers."""
    from spin_usd.formats.image_file import ENDINGS  # not above: it loads Pillow, which a plan of labels does not need

    bits = scene.sensor.bit_depth
    if f"uint{bits}" not in ENDINGS[image_suffix]:
        found = f"is {bits}, which {image_suffix} files cannot hold (picture {reader.variant}/{scene.frame.name})"
        do = "choose --image-format png, or make it 8"
        raise UnsupportedError(found, where=f"{reader.camera_path}.{schema.SENSOR['bit_depth']}", do=do)


SIDES = 128  # directions of view, some 13 degrees apart
SIDE_PX = 64  # side of the square picture of a view
FAR = 100.0  # radii away, where lines of sight are all but parallel
MANY_FACES = 1 << 22  # of a mesh: opened for rays they take seconds and a gigabyte, the middles of some cover as much
SHARPNESS = 60  # power of the cosine by which the sides near a line of sight count; falls to half at 9 degrees
FAINTEST = 1e-3  # of the nearest side's weight: sides beyond some 27 degrees do not count, and change 0.03 %


class Coverage:
    """Estimates the pixels that targets cover, by the share of its outline that a target fills, seen from any side.

    That share is computed once per mesh for each side of a half sphere that lies near a line of sight (front and back
    fill the same, seen from far away), and kept by mesh and holes; most pictures then cost a few operations. Over poses
    of Tango as in SPEED+ the error is 2 %, at most 5 %.
    """

    def __init__(self) -> None:
        self._sides, self._caster = half_sphere(SIDES), EmbreeCaster()
        self._filled: dict[tuple[str, str], Float] = {}  # NaN for a side not needed yet

    def target_pixels(self, scene: Scene) -> float:
        """Return the approximate number of pixels that the bodies of `scene` cover."""
        return min(sum(map(self._pixels, scene.one_body_scenes)), scene.outline_pixels)

    def _pixels(self, scene: OneBody) -> float:
        """Return the approximate number of pixels that the target of `scene` covers alone."""
        target, pose = scene.target, scene.T_cam_body
        key = target.mesh.key, target.cut_out_key
        known = self._filled.setdefault(key, np.full(SIDES, np.nan))
        towards = pose.rotation.T @ pose.points(target.mesh.centre)
        along = (self._sides @ towards / max(float(np.linalg.norm(towards)), 1e-300)) ** SHARPNESS
        near = along > FAINTEST * along.max()
        unknown = np.flatnonzero(near & np.isnan(known))  # few pictures need few sides
        known[unknown] = [filled(scene, side, self._caster) for side in self._sides[unknown]]
        total = float(along[near].sum())
        return scene.outline_pixels * (float(along[near] @ known[near]) / total if total else 1.0)


def filled(scene: OneBody, side: Float, caster: EmbreeCaster) -> float:
    """Return the share of its outline that the target fills, seen from afar along `side` (3,), unit, body axes."""
    mesh = scene.target.mesh
    across = np.cross(side, np.eye(3)[np.abs(side).argmin()])
    across /= np.linalg.norm(across)
    rotation = np.stack([across, np.cross(side, across), side])
    place = FAR * max(mesh.radius, 1e-300) * np.array([0, 0, 1]) - rotation @ mesh.centre
    pose = Transform(to=scene.T_cam_body.to, of=scene.T_cam_body.of, rotation=rotation, translation=place)
    middle = SIDE_PX / 2
    camera = Camera(width=SIDE_PX, height=SIDE_PX, fx=middle * FAR, fy=middle * FAR, cx=middle, cy=middle)
    body = replace(scene.bodies[0].still, T_cam_body=pose)
    seen = replace(scene, camera=camera, bodies=(body,), thin_lens=None, shutter=None)
    if mesh.count > MANY_FACES:
        middles = pose.points(corners_of(mesh, evenly_spread(mesh)).mean(1))
        pixels = len(np.unique(camera.pixels(middles[:, :2] / middles[:, 2:]) // 1, axis=0))
    else:
        pixels = int(np.count_nonzero(caster.meets(seen, camera.centres(seen.region).reshape(-1, 2))))
    return min(pixels / outline, 1.0) if (outline := seen.outline_pixels) else 1.0
