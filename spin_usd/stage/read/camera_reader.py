"""The camera of a variant's pictures, in time: its lens, sensor, optics and shutter, and the objects in its axes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from pxr import Usd, UsdGeom

from spin_usd.errors import UnknownPictureError
from spin_usd.geometry.transform import Transform
from spin_usd.stage.read.camera import read_camera
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.read.optics import read_optics, read_thin_lens
from spin_usd.stage.read.rig import lidar_in_time, range_finder_in_time, rig_in_time
from spin_usd.stage.read.sensor import read_sensor
from spin_usd.stage.read.shutter import Opening, read_opening
from spin_usd.stage.usd.time_variation import CachedIfConstant, moves, varying
from spin_usd.stage.usd.transforms import Placement, placement

# Prefixes of the camera's attributes on which only the sensor, the optics, the shutter or the focus depends.
SENSOR = ("exposure", "spin:sensor:")
OPTICS = ("spin:optics:",)
SHUTTER = ("shutter:", "spin:shutter:")
FOCUS = ("fStop", "focusDistance")


def chosen_camera(
    stage: Usd.Stage, cameras: Mapping[str, Usd.Prim], name: str, *, variant: str, variants: Sequence[str]
) -> Usd.Prim:
    """Find the camera of that name among the stage's `cameras`, the first where the `variant` of the `variants` names
    none. Raises UnknownPictureError."""
    names = list(cameras)
    chosen = name or names[0]
    if chosen not in names or name == names[0]:
        do = f"choose among the variants {', '.join(variants)}"
        where = stage.GetRootLayer().realPath
        raise UnknownPictureError(f"has no variant '{variant}'", where=where, do=do)
    return cameras[chosen]


class CameraReader:
    """Reads each part of the camera `prim` at a time: once where it cannot change. `cameras`: all of the stage's, by
    name; `metres`: the length of a stage unit; `clock`: the stage's.

    The readers refer to the prim, not to this object: a reference cycle would keep the stage open for a while.
    """

    def __init__(
        self, stage: Usd.Stage, cameras: Mapping[str, Usd.Prim], prim: Usd.Prim, metres: float, clock: Clock
    ) -> None:
        self._prim, self._clock, names = prim, clock, varying(prim)
        lens = any(not name.startswith((*SENSOR, *OPTICS, *SHUTTER, *FOCUS)) for name in names)

        def varies(*prefixes: str) -> bool:
            return lens or any(name.startswith(prefixes) for name in names)

        def T_world_usdcam(time: Usd.TimeCode) -> Transform:
            return _placement(prim, UsdGeom.XformCache(time), "usdcam", metres).transform

        camera = CachedIfConstant(lens, partial(read_camera, prim))
        self._shutter_varies = varies(*SHUTTER) or clock.timed
        self.T_world_usdcam = CachedIfConstant(moves(prim), T_world_usdcam)
        self.camera = camera
        self.sensor = CachedIfConstant(varies(*SENSOR), partial(read_sensor, prim))
        self.optics = CachedIfConstant(varies(*OPTICS), lambda time: read_optics(prim, camera.at(time), time))
        self.thin_lens = CachedIfConstant(varies(*FOCUS), lambda time: read_thin_lens(prim, time, metres))
        self._opening: Opening | None = None
        self.rig, self.pair = rig_in_time(cameras, prim, metres)
        self.lidar = lidar_in_time(stage, prim, metres)
        self.range_finder = range_finder_in_time(stage, prim, metres)

    def opening_at(self, time_code: float) -> Opening:
        """Return the exposure of the frame at `time_code`."""
        rows = self.camera.at(Usd.TimeCode(time_code)).height
        if self._shutter_varies:
            return read_opening(self._prim, time_code, self._clock, rows=rows)
        if self._opening is None:
            self._opening = read_opening(self._prim, 0.0, self._clock, rows=rows)
        return replace(self._opening, middle=time_code + self._opening.middle)


def _placement(prim: Usd.Prim, world: UsdGeom.XformCache, frame: str, metres: float) -> Placement:
    """Compute the placement of `prim` at the time of `world`, its frame named `frame`."""
    return placement(world.GetLocalToWorldTransform(prim), frame=frame, metres=metres, where=prim.GetPath())
