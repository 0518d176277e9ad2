"""A composed stage at a time code, as a Scene."""

from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.finding import Finding
from spin_usd.scene.model import NOMINAL, FrameId, Scene
from spin_usd.scene.photometry.eclipse import eclipsed
from spin_usd.scene.target import Target
from spin_usd.stage.composition.images import Images
from spin_usd.stage.composition.open_stage import open_stage, variants
from spin_usd.stage.composition.stage_hash import stage_hash, used_files
from spin_usd.stage.read.camera.camera import find_camera, read_camera
from spin_usd.stage.read.camera.depth_of_field import read_thin_lens
from spin_usd.stage.read.camera.optics import read_optics
from spin_usd.stage.read.camera.sensor import read_sensor
from spin_usd.stage.read.camera.shutter import Opening, read_opening, read_shutter
from spin_usd.stage.read.environment.environment import EnvironmentReader
from spin_usd.stage.read.frames import read_frames, read_seed
from spin_usd.stage.read.lights.lights import LightReader
from spin_usd.stage.read.target.renderable import refuse_geometry_outside
from spin_usd.stage.read.target.target import TargetReader, find_target
from spin_usd.stage.read.target.time_variation import target_varies
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.notes import Notes
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, root_number
from spin_usd.stage.usd.time_variation import CachedIfConstant, moves, varying
from spin_usd.stage.usd.transforms import (
    UNIT_SCALE_TOLERANCE,
    Placement,
    between,
    check_chain,
    nearest_ancestor,
    placement,
    placement_below,
)
from spin_usd.stage.usd.visibility import PROXIES

# Prefixes of the camera's attributes on which only the sensor, the optics, the shutter or the focus depends.
SENSOR = ("exposure", "spin:sensor:")
OPTICS = ("spin:optics:",)
SHUTTER = ("shutter:", "spin:shutter:")
FOCUS = ("fStop", "focusDistance")


class StageReader:
    """Turns an opened stage into one Scene per frame; whatever does not change is read once and shared.

    frames: the stage's frames · seed: the dataset's · variants: all that the stage has · variant: the selected one.
    Raises StageError for a stage that lacks what a picture needs, UnsupportedError for features not supported yet.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        variant: str = NOMINAL,
        stage: Usd.Stage | None = None,
        after: "StageReader | None" = None,
    ):
        """Open the stage at `path`. `stage`: the same stage in that variant if it is open already, perhaps with other
        sets' selections. `after`: a reader of another variant of the same files, whose decoded images are used
        again."""
        self.stage: Usd.Stage = stage or open_stage(path, variant=variant)
        self.variant = variant
        self.variants = variants(self.stage)
        self.metres = metres_per_unit(self.stage)
        self._camera_prim = find_camera(self.stage)
        self._target_prim = find_target(self.stage)
        refuse_geometry_outside(self._target_prim)
        self._notes = Notes()
        self._images: Images = Images(before=after._images.decoded if after else {})
        self._lights = LightReader(self.stage, self._images)
        self._environment = EnvironmentReader(self.stage, self._images)
        check_chain(self._camera_prim)
        check_chain(self._target_prim)
        self.frames: tuple[FrameId, ...] = read_frames(self.stage, variant)
        self.seed = read_seed(self.stage)
        self._read_camera_parts()
        self._target: Target | None = None
        self._target_scale = float("nan")
        self._target_varies = True

    @cached_property
    def stage_hash(self) -> str:
        """Digest of the composed content with its variant, wherever the stage lies."""
        return stage_hash(self.stage)

    @cached_property
    def used_files(self) -> dict[str, str]:
        """Path relative to the root layer's folder -> sha256 (hex) of every layer and asset of this composition."""
        return used_files(self.stage, Path(self.stage.GetRootLayer().realPath).parent)

    @property
    def notes(self) -> tuple[Finding, ...]:
        """Warnings about what was read so far and is rendered differently from what the stage authors."""
        return self._notes.findings

    @property
    def camera_path(self) -> str:
        """The path of the camera's prim."""
        return str(self._camera_prim.GetPath())

    @property
    def light_is_still(self) -> bool:
        """Return whether lights, and planets that could hide them, are the same in camera axes in all pictures."""
        return self._lights.still and self._environment.still and not self._T_world_usdcam.varies

    @cached_property
    def variant_selections(self) -> dict[str, str]:
        """The selection of each variant set: by its name for the default prim's, by "PATH{NAME}" for others."""
        default = self.stage.GetDefaultPrim()
        selections: dict[str, str] = {}
        for prim in Usd.PrimRange.Stage(self.stage, PROXIES):
            for name, variant in prim.GetVariantSets().GetAllVariantSelections().items():
                if variant:
                    selections[name if prim == default else f"{prim.GetPath()}{{{name}}}"] = variant
        return selections

    def scene(self, frame: FrameId) -> Scene:
        """Read everything that a picture of `frame` needs, at the middle of its exposure. The target is the same object
        as long as it does not change."""
        opening = self._opening_at(frame.time_code)
        time = Usd.TimeCode(opening.middle)
        world = UsdGeom.XformCache(time)
        T_world_usdcam = self._T_world_usdcam.at(time)
        T_cam_body, body_scale = self._body_at(time, world)
        target = self._target_at(time, body_scale)
        centre = T_cam_body.points(target.mesh.centre)
        space = CameraSpace(time=time, world=world, T_world_usdcam=T_world_usdcam, metres=self.metres)
        lights = self._lights.read(space)
        environment = self._environment.read(space, centre, target.mesh.radius)
        return Scene(
            frame=frame,
            camera=self._camera.at(time),
            T_cam_body=T_cam_body,
            target=target,
            lights=eclipsed(lights, environment.planets, centre),
            environment=environment,
            sensor=self._sensor.at(time),
            optics=self._optics.at(time),
            thin_lens=self._thin_lens.at(time),
            shutter=read_shutter(opening, self.pose_at, self._camera_prim.GetPath()),
        )

    def target_at(self, time_code: float) -> Target:
        """Read the target alone at a time code, metres."""
        time = Usd.TimeCode(time_code)
        return self._target_at(time, self._body_at(time, UsdGeom.XformCache(time))[1])

    def pose_at(self, time_code: float) -> Transform:
        """Compute T_cam_body at a time code."""
        time = Usd.TimeCode(time_code)
        return self._body_at(time, UsdGeom.XformCache(time))[0]

    def _body_at(self, time: Usd.TimeCode, world: UsdGeom.XformCache) -> tuple[Transform, float]:
        """Compute T_cam_body, and the scale of the body's axes in the world. Units are applied last: a far origin would
        be rounded by them."""
        usdcam, size = self._usdcam_below.at(time)
        body = placement_below(self._above, self._target_prim, world, frame="body")
        near = between(usdcam, body.transform)
        metres = near.translation * (size * self.metres)
        return T_CAM_USDCAM @ Transform.unchecked(
            to=near.to, of=near.of, rotation=near.rotation, translation=metres
        ), size * body.scale

    def _read_camera_parts(self) -> None:
        """Set up how each part of the camera is read, and which of them can change in time.

        The readers refer to the prim, not to this object: a reference cycle would keep the stage open for a while.
        """
        prim, metres, names = self._camera_prim, self.metres, varying(self._camera_prim)
        lens = any(not name.startswith((*SENSOR, *OPTICS, *SHUTTER, *FOCUS)) for name in names)

        def varies(*prefixes: str) -> bool:
            return lens or any(name.startswith(prefixes) for name in names)

        def T_world_usdcam(time: Usd.TimeCode) -> Transform:
            return _placement(prim, UsdGeom.XformCache(time), "usdcam", metres).transform

        camera = CachedIfConstant(lens, partial(read_camera, prim))
        self._above = nearest_ancestor(prim, self._target_prim)
        self._usdcam_below = CachedIfConstant(moves(prim), partial(_below, self._above, prim))
        self._shutter_varies = varies(*SHUTTER)
        self._T_world_usdcam = CachedIfConstant(moves(prim), T_world_usdcam)
        self._camera = camera
        self._sensor = CachedIfConstant(varies(*SENSOR), partial(read_sensor, prim))
        self._optics = CachedIfConstant(varies(*OPTICS), lambda time: read_optics(prim, camera.at(time), time))
        self._thin_lens = CachedIfConstant(varies(*FOCUS), lambda time: read_thin_lens(prim, time, metres))
        self._opening: Opening | None = None

    def _opening_at(self, time_code: float) -> Opening:
        """Return the exposure of the frame at `time_code`."""
        rows = self._camera.at(Usd.TimeCode(time_code)).height
        if self._shutter_varies:
            return read_opening(self._camera_prim, time_code, rows=rows)
        if self._opening is None:
            self._opening = read_opening(self._camera_prim, 0.0, rows=rows)
        return replace(self._opening, middle=time_code + self._opening.middle)

    def _target_at(self, time: Usd.TimeCode, scale: float) -> Target:
        """Return the target at `time`: the last one again where nothing below it can vary, or nothing did."""
        same_scale = abs(scale - self._target_scale) < UNIT_SCALE_TOLERANCE
        if self._target is not None and same_scale and not self._target_varies:
            return self._target
        reader = TargetReader(
            prim=self._target_prim,
            time=time,
            group_of=self._lights.links.group_of,
            images=self._images,
            notes=self._notes,
        )
        target = reader.read(scale * self.metres)
        if self._target is None:
            self._target_varies = target_varies(self._target_prim, reader.visited)
        if self._target is None or target.key != self._target.key:
            self._target = target
        self._target_scale = scale
        return self._target


def _below(above: Usd.Prim, camera: Usd.Prim, time: Usd.TimeCode) -> tuple[Transform, float]:
    """Compute T_above_usdcam in units of `above`, and the size of these units in the world."""
    world = UsdGeom.XformCache(time)
    size = _placement(above, world, "above", 1.0).scale
    return placement_below(above, camera, world, frame="usdcam").transform, size


def _placement(prim: Usd.Prim, world: UsdGeom.XformCache, frame: str, metres: float) -> Placement:
    """Compute the placement of `prim` at the time of `world`, its frame named `frame`."""
    return placement(world.GetLocalToWorldTransform(prim), frame=frame, metres=metres, where=prim.GetPath())


def metres_per_unit(stage: Usd.Stage) -> float:
    """Return the length of a stage unit. Raises StageError for units or an up axis that are not valid."""
    where = stage.GetRootLayer().realPath
    metres = root_number(stage, METRES_PER_UNIT)
    if not np.isfinite(metres) or metres <= 0:
        raise StageError(f"metersPerUnit is {metres:g}", where=where, do="make it positive")
    up = str(UsdGeom.GetStageUpAxis(stage))
    if up not in ("Y", "Z"):
        raise StageError(f"upAxis is '{up}'", where=where, do="set it to Y or Z")
    return metres
