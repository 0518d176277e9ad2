"""A stage with some of its values replaced, picture after picture: where bodies and parts are, and what is sampled."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.body import OCCLUDER
from spin_usd.scene.scene import FrameId, Scene, augmentation_and_camera
from spin_usd.stage.augment.attribute_change import AttributeChange, BaseStage, ChangedAttribute, attribute_of
from spin_usd.stage.augment.parameters import attribute_changes, parameter_named
from spin_usd.stage.augment.sampled_values import SampledValue, SampledValues, write_values
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.bodies.find_bodies import target_name
from spin_usd.stage.read.body_reader import BodyReader
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import quatd, vec3d
from spin_usd.stage.usd.time_variation import CachedIfConstant
from spin_usd.stage.usd.transforms import EDITED
from spin_usd.stage.usd.values import read

PLACED = {"xformOp:translate": "double3", "xformOp:orient": "quatd", "xformOp:scale": "double3"}
"""The operations that place a target, which USD interpolates well, and their types."""
MOTION = "spin:motion:"  # removed from a target that is placed anew
PART, RESET = "xformOp:transform", "!resetXformStack!"


@dataclass(frozen=True, kw_only=True, eq=False)
class Edits:
    """Changes of a stage for one picture."""

    poses: Mapping[str, Float] = field(default_factory=dict)
    """T_cam_body (4, 4) by the names of targets."""
    parts: Mapping[str, Float] = field(default_factory=dict)
    """New places of parts of the first target, by name: (4, 4) in the target's axes, metres."""
    lights: Mapping[str, float] = field(default_factory=dict)
    """Factors on the strengths of lights, by their names or paths."""
    values: Mapping[str, Any] = field(default_factory=dict)
    """Values of parameters by name, each in its own unit."""
    selections: Mapping[str, str] = field(default_factory=dict)
    """Variants of the default prim's other sets, by set."""

    @property
    def names(self) -> tuple[tuple[str, ...], ...]:
        """The edited things, and the selections."""
        edited = (self.poses, self.parts, self.lights, self.values)
        selected = tuple(f"{name}={chosen}" for name, chosen in sorted(self.selections.items()))
        return (*(tuple(sorted(each)) for each in edited), selected)


class EditedStage:
    """The stage of the reader `base`, whose same things are edited for each picture.

    Edits are authored in the session layer, in time samples of one value: so readers treat them as values that change
    in time, and everything else keeps the frame's own time.
    """

    def __init__(self, path: str | Path, base: StageReader, frame: FrameId, edits: Edits) -> None:
        """Open the stage at `path`. Raises InputError for anything that it does not have."""
        augmentation = augmentation_and_camera(base.variant)[0]
        self.stage: Usd.Stage = open_stage(path, variant=augmentation, selections=edits.selections)
        under = base.stage  # whose values factors multiply
        if edits.selections:
            under = open_stage(path, variant=augmentation, selections=edits.selections)
        self._layer = self.stage.GetSessionLayer()
        self._editor = Editor(base, under, frame)
        changes = self._editor.changes(tuple(edits.values))
        fixed = [SampledValue(attribute=a, value=v) for change in changes for a, v in change.fixed]
        apis = tuple(api for change in changes for api in change.apis)
        write_values(self._layer, SampledValues(attributes=tuple(fixed), apis=apis))
        for prim in self._editor.moved(edits):
            self._editor.hold(prim, self._layer)
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
        values = (
            SampledValue(attribute=attribute, value=value)
            if attribute.uniform
            else SampledValue(attribute=attribute, samples=((0.0, value), (1.0, value)))
            for attribute, value in self._editor.values(frame, edits)
        )
        write_values(self._layer, SampledValues(attributes=tuple(values)))


class Editor:
    """Decides which attributes of a stage change with edits, and how.

    `base`: a reader of the stage; `under`: the stage as it is selected, whose values factors multiply; `frame`: one of
    its frames.
    """

    def __init__(self, base: StageReader, under: Usd.Stage, frame: FrameId) -> None:
        self.base = base
        self.over = BaseStage(
            stage=under,
            times=(frame.time_code,),
            metres=base.metres,
            chosen_camera=under.GetPrimAtPath(base.camera_prim.GetPath()),
        )
        self.targets = {target_name(body.prim): body for body in base.bodies if body.id != OCCLUDER}
        self._parts = dict(_parts(base))
        self._lights = dict(_lights(under))
        self._known: dict[tuple[str, ...], tuple[AttributeChange, ...]] = {}

    def changes(self, names: tuple[str, ...]) -> tuple[AttributeChange, ...]:
        """Return the changes that these parameters make. Raises InputError for one that has nothing to change."""
        if names not in self._known:
            self._known[names] = changes = attribute_changes(self.over, names)
            if added := next((change for change in changes if change.copies), None):
                do = "augment the stage with it, and choose that variant"
                raise InputError("adds a prim", where=added.parameters[0], do=do)
        return self._known[names]

    def moved(self, edits: Edits) -> list[Usd.Prim]:
        """Return the prims to place anew. Raises InputError for an unknown name."""
        return [*(self._body(name).prim for name in edits.poses), *map(self._part, edits.parts)]

    def parts_at(self, paths: Collection[Sdf.Path]) -> list[str]:
        """Return the names of the parts whose prims are at these paths."""
        return [name for name, prim in self._parts.items() if prim.GetPath() in paths]

    def hold(self, prim: Usd.Prim, layer: Sdf.Layer) -> None:
        """Place the prim by the operations of `values`, in `layer`, alone."""
        is_target = any(prim == body.prim for body in self.targets.values())
        over = Sdf.CreatePrimInLayer(layer, prim.GetPath())
        order = over.attributes.get("xformOpOrder") or Sdf.AttributeSpec(
            over, "xformOpOrder", Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform
        )
        shape = [schema.SHAPE_OP] if schema.SHAPE_OP in (order.default or ()) else []  # of a part that is changed too
        order.default = [RESET, *(f"{name}{EDITED}" for name in PLACED)] if is_target else [*shape, f"{PART}{EDITED}"]
        if is_target:
            over.SetInfo("apiSchemas", Sdf.TokenListOp.Create(deletedItems=[schema.MOTION_API]))
            for attribute in prim.GetAuthoredAttributes():
                if attribute.GetName().startswith(MOTION):
                    name, kind = attribute.GetName(), attribute.GetTypeName()
                    (over.attributes.get(name) or Sdf.AttributeSpec(over, name, kind)).default = Sdf.ValueBlock()

    def values(self, frame: FrameId, edits: Edits) -> Iterator[tuple[ChangedAttribute, Any]]:
        """Yield the attributes that are edited, with their values."""
        for name, value in edits.values.items():
            parameter_named(name).check(value)
        for change in self.changes(tuple(edits.values)):
            sampled = {name: edits.values[name] for name in change.parameters}
            try:
                made = change.values(sampled, frame.time_code)
            except (TypeError, ValueError) as error:
                found = f"does not take {', '.join(map(str, sampled.values()))} ({error})"
                raise InputError(found, where=change.parameters[0], do="give it as an augmentation would") from None
            yield from zip(change.attributes, made, strict=True)
        for name, factor in edits.lights.items():
            if name not in self._lights:
                raise InputError(f"there is no light {name!r}", do=f"choose among {', '.join(self._lights) or 'none'}")
            intensity = UsdLux.LightAPI(self._lights[name]).GetIntensityAttr()
            yield attribute_of(intensity), float(read(intensity, Usd.TimeCode(frame.time_code))) * float(factor)
        world = UsdGeom.XformCache(Usd.TimeCode(frame.time_code))
        for name, T_cam_body in edits.poses.items():
            body = self._body(name)
            placed = self._placed(frame, body, world, T_cam_body)
            for operation, value in zip(PLACED, placed, strict=True):
                yield _operation(body.prim, operation, PLACED[operation]), value
        for name, moved in edits.parts.items():
            part = self._part(name)
            placed_part = self._part_placed(part, moved, world)
            yield _operation(part, PART, "matrix4d"), Gf.Matrix4d(placed_part.T.tolist())

    def _body(self, name: str) -> BodyReader:
        found = self.targets.get(name) if name else self.base.bodies[0]
        if found is None:
            raise InputError(f"there is no target {name!r}", do=f"choose among {', '.join(self.targets)}")
        return found

    def _part(self, name: str) -> Usd.Prim:
        if name not in self._parts:
            do = f"choose among {', '.join(self._parts) or 'none: it is one piece'}"
            raise InputError(f"there is no part {name!r} that can be moved", do=do)
        return self._parts[name]

    def _placed(
        self, frame: FrameId, body: BodyReader, world: UsdGeom.XformCache, T_cam_body: Float
    ) -> tuple[Gf.Vec3d, Gf.Quatd, Gf.Vec3d]:
        """Return the translation, the rotation and the scale from the body's axes to the world's, in stage units, for
        that pose."""
        _, scale = body.placed(world.GetTime(), world)
        pose = Transform(to="cam", of="body", rotation=T_cam_body[:3, :3], translation=T_cam_body[:3, 3])
        placed = self.base.T_world_cam(frame) @ pose
        return vec3d(placed.translation / self.base.metres), quatd(placed.quaternion), vec3d(np.full(3, scale))

    def _part_placed(self, prim: Usd.Prim, moved: Float, world: UsdGeom.XformCache) -> Float:
        """Return the matrix (4, 4) from the part's axes to its parent's for that motion in the target's axes."""
        body = next(body for body in self.targets.values() if prim.GetPath().HasPrefix(body.prim.GetPath()))
        _, scale = body.placed(world.GetTime(), world)
        of_target = np.array(moved, np.float64)
        of_target[:3, 3] /= scale * self.base.metres
        part, above = (_within(body.prim, each, world) for each in (prim, prim.GetParent()))
        placed: Float = np.linalg.inv(above) @ of_target @ part
        return placed


def _within(body: Usd.Prim, prim: Usd.Prim, world: UsdGeom.XformCache) -> Float:
    """Return the matrix (4, 4) from the prim's axes to the body's, in its units."""
    return np.array(world.ComputeRelativeTransform(prim, body)[0]).T


def _operation(prim: Usd.Prim, name: str, of_type: str) -> ChangedAttribute:
    return ChangedAttribute(prim=str(prim.GetPath()), name=f"{name}{EDITED}", type=of_type)


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
