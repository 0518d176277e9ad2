"""part.NAME.*: parts of a target that are not quite as drawn, with the keypoints on them."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, Vt

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.part_axes import PartAxes, nearest
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.geometry.triangles import unit_vectors
from spin_usd.scene.target import Part
from spin_usd.stage.augment.attribute_change import AttributeChange, BaseStage, ChangedAttribute, ParameterValues
from spin_usd.stage.augment.body_axes import cam_from_body
from spin_usd.stage.augment.parameter import DIRECTION, NUMBER, TRUTH, Parameter
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.body_parts import BodyParts
from spin_usd.stage.read.bodies.find_bodies import find_targets
from spin_usd.stage.read.bodies.keypoints import find_keypoints, read_keypoints
from spin_usd.stage.read.bodies.part_labels import labels_of_target
from spin_usd.stage.read.bodies.target import TargetReader
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.values import FINITE, Range, read
from spin_usd.stage.usd.visibility import ancestors, first_shown, is_invisible

ON_PART = 0.01  # of the longest edge of the target's box: how far from a part's surface its keypoints may lie
PLACED = ("turn", "axis", "shift", "scale")
Changed = tuple[ChangedAttribute, Callable[[ParameterValues, float], Any]]


@dataclass(eq=False)
class DrawnTarget:
    """A target as its model has it, in its own axes and units."""

    prim: Usd.Prim
    base: BaseStage

    def __post_init__(self) -> None:
        parts, notes = BodyParts().add(self.prim), Notes()
        reader = TargetReader(
            prim=self.prim,
            parts=parts,
            time=first_shown(self.prim, self.base.first),
            group_of=lambda _: 0,
            images=Images(check=False),
            notes=notes,
        )
        self.target = reader.read(1.0)
        mesh = self.target.mesh
        self._corners = np.concatenate([points[faces] for points, faces in mesh.placed])
        own = [each.parts[:, each.shape.face_part].reshape(-1) for each in mesh.instances]
        self._part = np.concatenate([mesh.face_part, *own])

    @cached_property
    def metres(self) -> float:
        """The length of a unit of its axes."""
        camera = self.base.camera
        return cam_from_body(self.base, self.prim, camera, self.base.times[0])[1] * self.base.metres

    def named(self, name: str) -> list[Part]:
        """Find its parts of that name, or all for "*"."""
        return [
            part for part in self.target.parts if name in ("*", part.name) and part.path != str(self.prim.GetPath())
        ]

    def refuse_none_left(self, missing: list[str], time: float, where: str) -> None:
        """Raise InputError where all parts that it can show are at or below the `missing` prims, by their paths, in the
        picture at that time code, which shows it."""
        roots, at = tuple(f"{path}/" for path in missing), Usd.TimeCode(time)
        if not all(f"{part.path}/".startswith(roots) for part in self.target.parts):
            return
        if any(is_invisible(each, at) for each in (*ancestors(self.prim), self.prim)):
            return
        picture = f" in picture {self.base.names[time]}" if time in self.base.names else ""
        do = "name the parts that may be missing, so that one always stays"
        raise InputError(f"all parts of the target {self.target.name} are missing{picture}", where=where, do=do)

    def axes(self, parts: list[Part]) -> PartAxes:
        """Find the axes of one piece of these parts and all below them."""
        roots = tuple(f"{part.path}/" for part in parts)
        ids = [part.id for part in self.target.parts if f"{part.path}/".startswith(roots)]
        own = np.isin(self._part, ids)
        if not own.any():
            raise InputError("is a part without a visible surface", where=parts[0].path, do="leave it as it is")
        return PartAxes.of(self._corners[own], self._corners[~own])

    @cached_property
    def keypoint_parts(self) -> tuple[ChangedAttribute, Any] | None:
        """The attribute for the part of each keypoint, with its value; None without keypoints."""
        prim = find_keypoints(self.prim)
        _, points = read_keypoints(self.prim, self.base.first)
        if not prim or not len(points):
            return None
        away, face = nearest(points, self._corners)
        paths = [self.target.parts[self._part[each] - 1].path for each in face]
        below = [path.removeprefix(f"{self.prim.GetPath()}/") for path in paths]
        on = away <= ON_PART * self.target.mesh.size.max()
        names = [path if near and path != self.target.path else "" for path, near in zip(below, on, strict=True)]
        at = ChangedAttribute(prim=str(prim.GetPath()), name=schema.KEYPOINT_PARTS, type="string[]", uniform=True)
        return at, Vt.StringArray(names)


def part_shape(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Return the change that all part.NAME.* make together: NAME+NAME is one piece, with one root. Raises InputError
    for a part that no target has, that cannot be overridden, or that is in two pieces; its values do for a picture in
    which all parts of a target are missing."""
    fields: dict[str, list[str]] = {}
    for piece, field in map(split_name, names):
        fields.setdefault(piece, []).append(field)
    targets = [DrawnTarget(prim, base) for prim in find_targets(base.stage)]
    changes = [each for piece in fields for each in _changes(targets, piece, fields[piece])]
    found: dict[str, Changed] = {}
    for changed in (changed for change, prim in changes for changed in change.of(prim)):
        if found.setdefault(str(changed[0]), changed) is not changed:
            raise InputError(f"changes {changed[0].prim} twice", where=names[0], do="name each part once")
    fixed = [each for change, prim in changes for each in change.fixed(prim)]

    def values(sampled: ParameterValues, time: float) -> tuple[Any, ...]:
        made = tuple(make(sampled, time) for _, make in found.values())
        of_parts = (
            (at.prim, value)
            for (at, _), value in zip(found.values(), made, strict=True)
            if at.name == schema.SHAPE_MISSING
        )
        if missing := [path for path, value in of_parts if value]:
            where = next(name for name in names if name.endswith(".missing"))
            for target in targets:
                target.refuse_none_left(missing, time, where)
        return made

    return AttributeChange(
        parameters=names,
        attributes=tuple(attribute for attribute, _ in found.values()),
        values=values,
        fixed=tuple({str(attribute): (attribute, value) for attribute, value in fixed}.values()),
        apis=tuple((str(prim.GetPath()), schema.SHAPE_API) for _, prim in changes),
    )


def _changes(targets: list[DrawnTarget], piece: str, fields: list[str]) -> Iterator[tuple["PieceChange", Usd.Prim]]:
    """Yield the changes of the pieces that NAME means, with each prim of theirs."""
    where = f"part.{piece}"
    for target, parts in _pieces(targets, piece, where):
        change = PieceChange(target=target, axes=target.axes(parts), piece=piece, fields=fields)
        yield from ((change, _prim(target, part, where)) for part in parts)


def split_name(parameter: str) -> tuple[str, str]:
    """Return NAME and the field of part.NAME.FIELD."""
    piece, _, field = parameter.removeprefix("part.").rpartition(".")
    return (piece.removesuffix(".shift"), f"shift.{field}") if piece.endswith(".shift") else (piece, field)


def _pieces(targets: list[DrawnTarget], piece: str, where: str) -> Iterator[tuple[DrawnTarget, list[Part]]]:
    """Yield the parts of each piece that NAME means, with their target: parts of one name are pieces of their own."""
    named = piece.split("+")
    for target in targets:
        parts = [part for name in named for part in target.named(name)]
        yield from ((target, each) for each in ([parts] if len(named) > 1 and parts else [[part] for part in parts]))
    known = {part.name for target in targets for part in target.named("*")}
    for name in named:
        if name != "*" and name not in known:
            do = f"choose among {', '.join(sorted(known)[:20]) or 'none: it is one piece'}"
            raise InputError(f"no target has a part {name!r}", where=where, do=do)


def _prim(target: DrawnTarget, part: Part, where: str) -> Usd.Prim:
    prim = target.base.stage.GetPrimAtPath(part.path)
    if part.name in labels_of_target(target.prim).merged:
        raise InputError(f"{part.name} is merged of several prims", where=where, do="take it out of mergedParts")
    if not prim or not prim.IsA(UsdGeom.Xformable) or prim.IsInstanceProxy():
        do = "author the part as a prim of its own that is not an instance's"
        raise InputError(f"{part.path} cannot be overridden", where=where, do=do)
    if prim.HasAPI(schema.SHAPE_API):
        raise InputError(f"{part.path} is changed already", where=where, do="start from the stage without augmentation")
    return prim


@dataclass(frozen=True, kw_only=True, eq=False)
class PieceChange:
    """The changes of the prims of one piece."""

    target: DrawnTarget
    axes: PartAxes
    piece: str
    fields: list[str]

    def of(self, prim: Usd.Prim) -> Iterator[Changed]:
        """Yield the attributes of a prim of the piece, with functions of the sampled values and the time code."""

        def at(name: str, of_type: str) -> ChangedAttribute:
            return ChangedAttribute(prim=str(prim.GetPath()), name=name, type=of_type)

        if self._is_placed:
            yield at(schema.SHAPE_OP, "matrix4d"), lambda values, time: self._placed(prim, values, time)
        if "missing" in self.fields:
            own = UsdGeom.Imageable(prim).GetVisibilityAttr()
            yield at(schema.SHAPE_MISSING, "bool"), lambda values, _: bool(self._value(values, "missing", False))
            yield (
                at("visibility", "token"),
                lambda values, time: (
                    "invisible" if self._value(values, "missing", False) else str(read(own, Usd.TimeCode(time)))
                ),
            )
        if "bulged" in self.fields:
            yield at(schema.SHAPE_BULGE, "double"), lambda values, _: self._value(values, "bulged", 0) / self._metres
        if "bent" in self.fields:
            yield at(schema.SHAPE_BEND, "double"), lambda values, _: float(self._value(values, "bent", 0))
            yield at(schema.SHAPE_BEND_FRAME, "matrix4d"), lambda values, _: _matrix(self._bend(values)[0])
            yield at(schema.SHAPE_BEND_LENGTH, "double"), lambda values, _: self._bend(values)[1]

    def fixed(self, prim: Usd.Prim) -> Iterator[tuple[ChangedAttribute, Any]]:
        """Yield the attributes that every value needs: the operations of the prim, and the parts of keypoints."""
        if self._is_placed:
            order = read(UsdGeom.Xformable(prim).GetXformOpOrderAttr()) or []
            at = ChangedAttribute(prim=str(prim.GetPath()), name="xformOpOrder", type="token[]", uniform=True)
            yield at, Vt.TokenArray([schema.SHAPE_OP, *order])
        if self.target.keypoint_parts:
            yield self.target.keypoint_parts

    @property
    def _is_placed(self) -> bool:
        return any(field.split(".")[0] in PLACED for field in self.fields)

    @property
    def _metres(self) -> float:
        return self.target.metres

    def _value(self, values: Mapping[str, Any], field: str, without: Any) -> Any:
        return values.get(f"part.{self.piece}.{field}", without)

    def _axis(self, values: ParameterValues, without: Float) -> Float:
        given = self._value(values, "axis", None)
        return without if given is None else unit_vectors(np.array(given, np.float64))

    def _bend(self, values: ParameterValues) -> tuple[Float, float]:
        return self.axes.bend_frame(self._axis(values, self.axes.length))

    def _placed(self, prim: Usd.Prim, values: ParameterValues, time: float) -> Gf.Matrix4d:
        """Return the operation of a prim, in its parent's axes, that turns and scales it about the root, and shifts
        it."""
        half, moved = np.radians(self._value(values, "turn", 0.0)) / 2, np.eye(4)
        turn = (
            matrix_from_quaternion([np.cos(half), *(np.sin(half) * self._axis(values, self.axes.longest))])
            if half
            else np.eye(3)
        )
        moved[:3, :3] = turn * self._value(values, "scale", 1.0)
        shift = np.array([self._value(values, f"shift.{axis}", 0.0) for axis in "xyz"]) / self._metres
        moved[:3, 3] = self.axes.root + shift - moved[:3, :3] @ self.axes.root
        if (moved == np.eye(4)).all():
            return Gf.Matrix4d(1)
        world = UsdGeom.XformCache(Usd.TimeCode(time))
        to_body = np.array(world.ComputeRelativeTransform(prim.GetParent(), self.target.prim)[0]).T
        return _matrix(np.linalg.inv(to_body) @ moved @ to_body)


def _matrix(matrix: Float) -> Gf.Matrix4d:
    return Gf.Matrix4d(matrix.T.tolist())


def _part(field: str, description: str, unit: str = "", limits: Range = FINITE, kind: str = NUMBER) -> Parameter:
    name = f"part.NAME.{field}"
    return Parameter(
        name=name, description=description, make=part_shape, unit=unit, limits=limits, kind=kind, group="part"
    )


LENGTHS = Range(-1e6, 1e6)
_ALL = (
    _part("turn", "Turn of the part about `axis` through its root, where it meets the craft.", "deg", Range(-360, 360)),
    _part("axis", "Axis of `turn` and direction of `bent`, body axes; default: its longest.", kind=DIRECTION),
    *(_part(f"shift.{axis}", f"Shift of the part along the body's {axis}.", "m", LENGTHS) for axis in "xyz"),
    _part("scale", "Factor on the part's size, about its root.", limits=Range(1e-3, 1e3)),
    _part("missing", "Whether the part is missing.", kind=TRUTH),
    _part("bent", "Angle between the directions of the part's root and end, as an arc.", "deg", Range(-180, 180)),
    _part("bulged", "Height of a smooth bulge of the part's flat faces outwards.", "m", LENGTHS),
)
PART_PARAMETERS: Mapping[str, Parameter] = {
    rf"part\..+\.{re.escape(each.name.removeprefix('part.NAME.'))}": each for each in _ALL
}
"""The parameters by patterns of their names."""
