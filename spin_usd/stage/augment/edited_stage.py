"""A stage with some of its values replaced, picture after picture: where bodies and parts are, and what is sampled."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.body import OCCLUDER
from spin_usd.scene.scene import FrameId, Scene, augmentation_and_camera
from spin_usd.stage.augment.attribute_change import BaseStage, ChangedAttribute, attribute_of
from spin_usd.stage.augment.parameters import attribute_changes, parameter_named
from spin_usd.stage.augment.sampled_values import SampledValue, SampledValues, write_values
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.bodies.find_bodies import target_name
from spin_usd.stage.read.body_reader import BodyReader
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.time_variation import CachedIfConstant
from spin_usd.stage.usd.values import read

OPERATION = "xformOp:transform:edited"
RESET = "!resetXformStack!"


@dataclass(frozen=True, kw_only=True, eq=False)
class Edits:
    """What a picture shows otherwise than the stage has it."""

    poses: Mapping[str, Float] = field(default_factory=dict)
    """T_cam_body (4, 4) by the names of targets."""
    parts: Mapping[str, Float] = field(default_factory=dict)
    """By the names of the first target's parts, where they are moved to: (4, 4) in the target's axes, metres."""
    lights: Mapping[str, float] = field(default_factory=dict)
    """Factors on the strengths of lights, by their names or paths."""
    values: Mapping[str, Any] = field(default_factory=dict)
    """Those of parameters, by name, each in its own unit."""
    selections: Mapping[str, str] = field(default_factory=dict)
    """Variants of the default prim's other sets, by set."""

    @property
    def names(self) -> tuple[tuple[str, ...], ...]:
        """What is edited, and what is selected."""
        edited = (self.poses, self.parts, self.lights, self.values)
        selected = tuple(f"{name}={chosen}" for name, chosen in sorted(self.selections.items()))
        return (*(tuple(sorted(each)) for each in edited), selected)


class EditedStage:
    """The stage of the reader `base`, over which the same things are edited for each picture.

    What is edited is authored in the session layer, in time samples of one value: so readers take it for what can
    change, and the frame's own time stays that of all else.
    """

    def __init__(self, path: str | Path, base: StageReader, frame: FrameId, edits: Edits) -> None:
        """Open the stage at `path`. Raises InputError for what it does not have."""
        self._base = base
        augmentation = augmentation_and_camera(base.variant)[0]
        self.stage: Usd.Stage = open_stage(path, variant=augmentation, selections=edits.selections)
        under = base.stage  # which factors multiply
        if edits.selections:
            under = open_stage(path, variant=augmentation, selections=edits.selections)
        over = BaseStage(
            stage=under,
            times=(frame.time_code,),
            metres=base.metres,
            chosen_camera=under.GetPrimAtPath(base.camera_prim.GetPath()),
        )
        self._targets = {target_name(body.prim): body for body in base.bodies if body.id != OCCLUDER}
        self._targets[""] = base.bodies[0]
        self._parts = dict(_parts(base))
        self._lights = dict(_lights(base.stage))
        self._changes = attribute_changes(over, tuple(edits.values))
        for name in (*edits.poses, *edits.parts):
            self._still(self._prim_of(name))
        fixed = [SampledValue(attribute=a, value=v) for change in self._changes for a, v in change.fixed]
        apis = tuple(api for change in self._changes for api in change.apis)
        write_values(self.stage.GetSessionLayer(), SampledValues(attributes=tuple(fixed), apis=apis))
        self._write(frame, edits)
        self._reader = StageReader(
            path, variant=base.variant, stage=self.stage, after=base, numbering=base.numbering, check_images=False
        )

    def scene(self, frame: FrameId, edits: Edits, *, views: Collection[str] = ()) -> Scene:
        """Read the scene of a frame with these edits, of the things that the stage was opened to edit."""
        self._write(frame, edits)
        CachedIfConstant.forget()
        return self._reader.scene(frame, views=views)

    def _write(self, frame: FrameId, edits: Edits) -> None:
        values = dict(self._values(frame, edits))
        again = [
            SampledValue(attribute=attribute, value=value)
            if attribute.uniform
            else SampledValue(attribute=attribute, samples=((0.0, value), (1.0, value)))
            for attribute, value in values.items()
        ]
        write_values(self.stage.GetSessionLayer(), SampledValues(attributes=tuple(again)))

    def _values(self, frame: FrameId, edits: Edits) -> Iterator[tuple[ChangedAttribute, Any]]:
        """Yield the attributes that are edited, with their values."""
        for name, value in edits.values.items():
            parameter_named(name).check(value)
        for change in self._changes:
            sampled = {name: edits.values[name] for name in change.parameters}
            yield from zip(change.attributes, change.values(sampled, frame.time_code), strict=True)
        for name, factor in edits.lights.items():
            if name not in self._lights:
                raise InputError(f"there is no light {name!r}", do=f"choose among {', '.join(self._lights) or 'none'}")
            intensity = UsdLux.LightAPI(self._lights[name]).GetIntensityAttr()
            yield attribute_of(intensity), float(read(intensity, Usd.TimeCode(frame.time_code))) * float(factor)
        world = UsdGeom.XformCache(Usd.TimeCode(frame.time_code))
        for name, T_cam_body in edits.poses.items():
            body = self._targets[name]
            yield _operation(body.prim), _matrix(self._placed(frame, body, world, T_cam_body))
        for name, moved in edits.parts.items():
            yield _operation(self._parts[name]), _matrix(self._part_placed(self._parts[name], moved, world))

    def _prim_of(self, name: str) -> Usd.Prim:
        if name in self._targets:
            return self._targets[name].prim
        if name in self._parts:
            return self._parts[name]
        known = ", ".join(filter(None, (*self._targets, *self._parts)))
        raise InputError(f"there is no target and no part {name!r}", do=f"choose among {known}")

    def _still(self, prim: Usd.Prim) -> None:
        """Let nothing but OPERATION say where the prim is."""
        over = self.stage.GetPrimAtPath(prim.GetPath())
        reset = [RESET] if str(prim.GetPath()) in {str(body.prim.GetPath()) for body in self._targets.values()} else []
        with Usd.EditContext(self.stage, self.stage.GetSessionLayer()):
            xformable = UsdGeom.Xformable(over)
            xformable.GetXformOpOrderAttr().Set([*reset, OPERATION])
            over.RemoveAppliedSchema(schema.MOTION_API)

    def _placed(self, frame: FrameId, body: BodyReader, world: UsdGeom.XformCache, T_cam_body: Float) -> Float:
        """Return the matrix (4, 4) from the body's axes to the world's, in stage units, that gives the pose."""
        _, scale = body.placed(world.GetTime(), world)
        pose = Transform(to="cam", of="body", rotation=T_cam_body[:3, :3], translation=T_cam_body[:3, 3])
        placed = (self._base.T_world_cam(frame) @ pose).matrix
        placed[:3, :3] *= scale
        placed[:3, 3] /= self._base.metres
        return placed

    def _part_placed(self, prim: Usd.Prim, moved: Float, world: UsdGeom.XformCache) -> Float:
        """Return the matrix (4, 4) from the part's axes to its parent's that moves it so in the target's axes."""
        body = next(body for body in self._targets.values() if prim.GetPath().HasPrefix(body.prim.GetPath()))
        _, scale = body.placed(world.GetTime(), world)
        of_target = np.array(moved, np.float64)
        of_target[:3, 3] /= scale * self._base.metres
        part, above = (_within(body.prim, each, world) for each in (prim, prim.GetParent()))
        placed: Float = np.linalg.inv(above) @ of_target @ part
        return placed


def _within(body: Usd.Prim, prim: Usd.Prim, world: UsdGeom.XformCache) -> Float:
    """Return the matrix (4, 4) from the prim's axes to the body's, in its units."""
    return np.array(world.ComputeRelativeTransform(prim, body)[0]).T


def _operation(prim: Usd.Prim) -> ChangedAttribute:
    return ChangedAttribute(prim=str(prim.GetPath()), name=OPERATION, type="matrix4d")


def _matrix(placed: Float) -> Gf.Matrix4d:
    return Gf.Matrix4d(placed.T.tolist())


def _parts(base: StageReader) -> Iterator[tuple[str, Usd.Prim]]:
    """Yield the parts of the first target that can be moved, by name."""
    for part in base.numbering.parts_of(base.bodies[0].prim).parts:
        prim = base.stage.GetPrimAtPath(part.path)
        if prim and prim != base.bodies[0].prim and prim.IsA(UsdGeom.Xformable):
            yield part.name, prim


def _lights(stage: Usd.Stage) -> Iterator[tuple[str, Usd.Prim]]:
    for prim in find_lights(stage):
        yield prim.GetName(), prim
        yield str(prim.GetPath()), prim
