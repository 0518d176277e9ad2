"""All errors of a stage's readers, each tried alone, since reading a picture ends at the first error."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import TypeAlias

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.errors import SpinError
from spin_usd.geometry.transform import Transform
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.find_bodies import find_occluders, find_targets, occluder_roots
from spin_usd.stage.read.bodies.gprim import GprimReader
from spin_usd.stage.read.bodies.keypoints import read_keypoints
from spin_usd.stage.read.bodies.part_labels import Labels
from spin_usd.stage.read.bodies.point_instancer import read_instances
from spin_usd.stage.read.bodies.renderable import is_geometry, is_left_out
from spin_usd.stage.read.camera import find_cameras, read_camera
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.read.environment import EnvironmentReader
from spin_usd.stage.read.frames import read_frames
from spin_usd.stage.read.lights import LightReader, read_light, refuse_light, visible_lights
from spin_usd.stage.read.optics import read_optics, read_thin_lens
from spin_usd.stage.read.sensor import read_sensor
from spin_usd.stage.read.shutter import read_opening
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.parser_faults import parser_faults
from spin_usd.stage.usd.root_metadata import Notes, metres_per_unit
from spin_usd.stage.usd.transforms import check_chain
from spin_usd.stage.usd.visibility import PROXIES, RENDERED_PURPOSES, is_invisible, own_purpose

Attempt: TypeAlias = Callable[[], object]

NOWHERE = Transform(to="world", of="usdcam", rotation=np.eye(3), translation=np.zeros(3))
"""A camera's pose, for reading values that do not depend on it."""


def refusals(stage: Usd.Stage) -> Iterator[SpinError]:
    """Yield the errors of the opened `stage` at its first frame, one for each prim."""
    for attempt in _attempts(stage):
        try:
            with parser_faults(stage.GetRootLayer().realPath):
                attempt()
        except SpinError as error:
            yield error


def _attempts(stage: Usd.Stage) -> Iterator[Attempt]:
    time = Usd.TimeCode.EarliestTime()
    with suppress(SpinError):
        time = Usd.TimeCode(read_frames(stage, "")[0].time_code)
    yield partial(metres_per_unit, stage)
    yield partial(read_frames, stage, "")
    yield from _of_camera(stage, time)
    yield from _of_bodies(stage, time)
    yield from _of_lights(stage, time)


def _of_camera(stage: Usd.Stage, time: Usd.TimeCode) -> Iterator[Attempt]:
    yield partial(find_cameras, stage)
    prims: tuple[Usd.Prim, ...] = ()
    with suppress(SpinError):
        prims = tuple(find_cameras(stage).values())
    for prim in prims:
        yield partial(check_chain, prim)
        yield partial(read_camera, prim, time)
        yield partial(read_sensor, prim, time)
        yield partial(read_thin_lens, prim, time, 1.0)
        yield partial(_try_opening, prim, stage)
        with suppress(SpinError):
            yield partial(read_optics, prim, read_camera(prim, time), time)


def _try_opening(camera: Usd.Prim, stage: Usd.Stage) -> None:
    read_opening(camera, 0.0, Clock(stage), rows=1)


def _of_bodies(stage: Usd.Stage, time: Usd.TimeCode) -> Iterator[Attempt]:
    """Try the targets and the occluders; without a target all geometry of the stage, since one of its prims is
    meant."""
    yield partial(find_targets, stage)
    roots: list[Usd.Prim] = [stage.GetPseudoRoot()]
    with suppress(SpinError):
        targets = find_targets(stage)
        for target in targets:
            yield partial(check_chain, target)
            yield partial(read_keypoints, target, time)
        roots = [*targets]
        cameras = find_cameras(stage).values()
        yield partial(find_occluders, targets, cameras)
        roots += occluder_roots(targets, cameras)
    images = Images()
    for prim in (each for root in roots for each in _to_render(root, time)):
        yield partial(_read_geometry, prim, time, images)


def _to_render(root: Usd.Prim, time: Usd.TimeCode) -> Iterator[Usd.Prim]:
    """Yield all prims at and below `root` that are rendered at `time` if they are geometry; only one of equal
    instances."""
    waiting, seen = [(root, "default")], set()
    while waiting:
        prim, inherited = waiting.pop()
        own = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath()
        if own in seen or is_invisible(prim, time) or prim.IsA(UsdGeom.Subset):
            continue
        seen.add(own)
        purpose = own_purpose(prim, inherited)
        if purpose in RENDERED_PURPOSES:
            yield prim
        waiting += [(child, purpose) for child in reversed(prim.GetFilteredChildren(PROXIES))]


def _read_geometry(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> None:
    if is_left_out(prim, Notes()) or not is_geometry(prim):
        return
    if prim.IsA(UsdGeom.PointInstancer):
        list(read_instances(prim, time))
    else:
        GprimReader(time=time, images=images, visited=[], notes=Notes()).read(prim, Labels().of_gprim(prim))


def _of_lights(stage: Usd.Stage, time: Usd.TimeCode) -> Iterator[Attempt]:
    images, world = Images(), UsdGeom.XformCache(time)
    for prim in visible_lights(stage):
        yield partial(_read_light, prim, time, world, images)
    yield partial(LightReader, stage, images)
    yield partial(EnvironmentReader, stage, images)


def _read_light(prim: Usd.Prim, time: Usd.TimeCode, world: UsdGeom.XformCache, images: Images) -> None:
    refuse_light(prim)
    read_light(prim, CameraSpace(time=time, world=world, T_world_usdcam=NOWHERE, metres=1.0), images)
