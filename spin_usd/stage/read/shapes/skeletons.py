"""The deformations of gprims by skeletons at one time, as UsdSkel's own library finds and computes them.

A prim is deformed only below a SkelRoot. Without animation the skeleton is in its rest pose; a skeleton without both,
or without bind pose, moves nothing, and its gprims stay as authored.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.triangles import Int, unit
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import PROXIES, ancestors


@dataclass(frozen=True, kw_only=True, eq=False)
class Deformation:
    """A gprim under a skeleton at one time, which deforms it by blend shapes, then by skinning."""

    query: UsdSkel.SkinningQuery
    time: Usd.TimeCode
    joint_transforms: Vt.Matrix4dArray | None
    """From the bind pose to the pose, for all the skeleton's joints.

    None where it lacks one of the two, so that only blend shapes act.
    """
    shape_weights: Sequence[float]
    """Of all the animation's blend shapes."""
    T_own_skeleton: Gf.Matrix4d
    """Row-vector matrix from the skeleton's axes, in which UsdSkel places skinned points, to the gprim's."""

    @property
    def skins(self) -> bool:
        """Return whether joints deform the gprim."""
        return self.joint_transforms is not None and bool(self.query.HasJointInfluences())

    def points(self, authored: Float) -> Float:
        """Deform the gprim's `authored` points (P, 3), in its own axes. Raises StageError for joint
        influences or blend shapes that do not fit them."""
        points = Vt.Vec3fArray.FromNumpy(authored.astype(np.float32))
        shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(self.query.GetPrim()))
        if weights := self._sub_shapes(shapes):
            where = shapes.ComputeBlendShapePointIndices()
            if not shapes.ComputeDeformedPoints(*weights, where, shapes.ComputeSubShapePointOffsets(), points):
                raise self._unfit("blend shapes")
        if not self.skins:
            return np.array(points, np.float64)
        if not self.query.ComputeSkinnedPoints(self.joint_transforms, points, self.time):
            raise self._unfit("joint influences")
        matrix = np.array(self.T_own_skeleton)
        moved: Float = np.array(points, np.float64) @ matrix[:3, :3] + matrix[3, :3]
        return moved

    def normals(self, authored: Float, at: Int, count: int) -> Float:
        """Deform `authored` normals (T, 3, 3) to unit normals at corners that are the points `at` (T, 3) of `count`."""
        normals = authored + self._normal_offsets(count)[at]
        if not self.skins:
            return unit(normals)
        indices, weights = self._influences(count)
        flat = Vt.Vec3fArray.FromNumpy(normals.reshape(-1, 3).astype(np.float32))
        joints = Vt.Matrix3dArray([_normal_matrix(matrix) for matrix in self._own_joints()])
        UsdSkel.SkinNormals(
            self.query.GetSkinningMethod(),
            _normal_matrix(self.query.GetGeomBindTransform(self.time)),
            joints,
            Vt.IntArray.FromNumpy(indices[at].reshape(-1).astype(np.int32)),
            Vt.FloatArray.FromNumpy(weights[at].reshape(-1).astype(np.float32)),
            indices.shape[1],
            flat,
        )
        rotated = np.array(flat, np.float64) @ np.array(_normal_matrix(self.T_own_skeleton))
        return unit(rotated).reshape(normals.shape)

    def matrix(self) -> Float:
        """Return the row-vector matrix (4, 4) that moves a gprim without points within its own axes. Raises StageError
        for influences that vary over it."""
        if not self.query.IsRigidlyDeformed():
            do = "make the shape a Mesh, or its joint influences constant"
            raise StageError("has no points that a skeleton could deform", where=self.query.GetPrim().GetPath(), do=do)
        moved = self.query.ComputeSkinnedTransform(self.joint_transforms, self.time)
        if moved is None:
            raise self._unfit("joint influences")
        return np.array(moved * self.T_own_skeleton)

    def _own_joints(self) -> Vt.Matrix4dArray:
        """Return the transforms in the gprim's own order of joints, to which its influences refer."""
        mapper = self.query.GetJointMapper()
        return mapper.RemapTransforms(self.joint_transforms, Vt.Matrix4dArray()) if mapper else self.joint_transforms

    def _influences(self, count: int) -> tuple[Int, Float]:
        """Return joints (P, N) and weights (P, N) of `count` points."""
        found = self.query.ComputeVaryingJointInfluences(count, self.time)
        if not found:
            raise self._unfit("joint influences")
        size = self.query.GetNumInfluencesPerComponent()
        return np.array(found[0], np.int64).reshape(count, size), np.array(found[1], np.float64).reshape(count, size)

    def _sub_shapes(self, shapes: UsdSkel.BlendShapeQuery) -> Any:
        """Return weights, blend shapes and sub-shapes (a shape itself or one of its inbetweens); empty without blend
        shapes."""
        if not (self.query.HasBlendShapes() and len(self.shape_weights)):
            return ()
        mapper = self.query.GetBlendShapeMapper()
        weights = Vt.FloatArray(list(self.shape_weights))
        return shapes.ComputeSubShapeWeights(mapper.Remap(weights) if mapper else weights)

    def _normal_offsets(self, count: int) -> Float:
        """Sum the blend shapes' offsets (P, 3) of the normals at `count` points."""
        shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(self.query.GetPrim()))
        total = np.zeros((count, 3))
        for weight, shape, sub_shape in zip(*self._sub_shapes(shapes) or ((), (), ()), strict=True):
            for indices, offsets in _normal_offsets(shapes, shape, sub_shape):
                if len(offsets) != (len(indices) or count) or (indices >= count).any():
                    raise self._unfit("blend shapes")
                total[indices if len(indices) else slice(None)] += weight * offsets
        return total

    def _unfit(self, what: str) -> StageError:
        return StageError(f"its {what} do not fit its points", where=self.query.GetPrim().GetPath(), do="fix them")


def _normal_offsets(shapes: UsdSkel.BlendShapeQuery, shape: int, sub_shape: int) -> Iterator[tuple[Int, Float]]:
    """Yield the points of one sub-shape, empty for all of them, and their normals' offsets, if it has any."""
    whole, between = shapes.GetBlendShape(shape), shapes.GetInbetween(sub_shape)
    offsets = (between.GetNormalOffsets() if between else read(whole.GetNormalOffsetsAttr())) or ()
    if len(offsets):
        indices = np.array(read(whole.GetPointIndicesAttr()) or (), np.int64)
        yield indices, np.array(offsets, np.float64).reshape(-1, 3)


def _normal_matrix(matrix: Gf.Matrix4d) -> Gf.Matrix3d:
    """Return the matrix for normals where the row-vector `matrix` moves points."""
    return matrix.ExtractRotationMatrix().GetInverse().GetTranspose()


@dataclass(eq=False)
class Skeletons:
    """Finds the deformations at one time. `visited` collects the prims on which they depend besides their gprims."""

    time: Usd.TimeCode
    visited: list[Usd.Prim]
    _cache: UsdSkel.Cache = field(default_factory=UsdSkel.Cache)
    _skeletons: dict[Sdf.Path, dict[Sdf.Path, UsdSkel.Skeleton]] = field(default_factory=dict)

    def deformation(self, gprim: Usd.Prim) -> Deformation | None:
        """Find the deformation of `gprim`; None where no skeleton moves it.

        Raises UnsupportedError where the target is only a part of the SkelRoot, StageError for a skeleton
        elsewhere or a transform that cannot be undone.
        """
        root = UsdSkel.Root.Find(gprim)
        skeleton = self._bound(root).get(gprim.GetPath()) if root else None
        if skeleton is None:
            return None
        above = _common_ancestor(gprim, skeleton.GetPrim())
        _check_position(root.GetPrim(), above, gprim, skeleton)
        query = self._cache.GetSkelQuery(skeleton)
        animation = query.GetAnimQuery()
        self.visited += [*_below(above, gprim), *_below(above, skeleton.GetPrim())]
        self.visited += [animation.GetPrim()] if animation else []
        return Deformation(
            query=self._cache.GetSkinningQuery(gprim),
            time=self.time,
            joint_transforms=query.ComputeSkinningTransforms(self.time) if query.HasBindPose() else None,
            shape_weights=(animation.ComputeBlendShapeWeights(self.time) if animation else None) or (),
            T_own_skeleton=self._relative(gprim, skeleton.GetPrim(), above),
        )

    def _bound(self, root: UsdSkel.Root) -> dict[Sdf.Path, UsdSkel.Skeleton]:
        """Map each gprim below `root` that has a skeleton to it."""
        path = root.GetPath()
        if path not in self._skeletons:
            self._cache.Populate(root, PROXIES)
            self._skeletons[path] = {
                query.GetPrim().GetPath(): binding.GetSkeleton()
                for binding in self._cache.ComputeSkelBindings(root, PROXIES)
                for query in binding.GetSkinningTargets()
            }
        return self._skeletons[path]

    def _relative(self, gprim: Usd.Prim, skeleton: Usd.Prim, above: Usd.Prim) -> Gf.Matrix4d:
        """Compute the row-vector matrix from the skeleton's axes to the gprim's own, both below the prim `above`."""
        cache = UsdGeom.XformCache(self.time)
        own, of_skeleton = (cache.ComputeRelativeTransform(prim, above)[0] for prim in (gprim, skeleton))
        if not np.isfinite(np.array(of_skeleton)).all() or not abs(own.GetDeterminant()) > 0:
            raise StageError("it or its skeleton is scaled to nothing", where=gprim.GetPath(), do="give it a size")
        return of_skeleton * own.GetInverse()


def _common_ancestor(first: Usd.Prim, second: Usd.Prim) -> Usd.Prim:
    """Find the nearest prim at or above both."""
    return first.GetStage().GetPrimAtPath(first.GetPath().GetCommonPrefix(second.GetPath()))


def _below(above: Usd.Prim, prim: Usd.Prim) -> list[Usd.Prim]:
    """List all prims from below `above` down to `prim`."""
    return [each for each in (*ancestors(prim), prim) if each != above and each.GetPath().HasPrefix(above.GetPath())]


def _check_position(root: Usd.Prim, above: Usd.Prim, gprim: Usd.Prim, skeleton: UsdSkel.Skeleton) -> None:
    if not above.GetPath().HasPrefix(root.GetPath()):
        found = f"its skeleton {skeleton.GetPath()} lies outside its SkelRoot {root.GetPath()}"
        raise StageError(found, where=gprim.GetPath(), do="move the skeleton below it")
    if any(prim.HasAPI(schema.TARGET_API) for prim in _below(root, gprim)):
        found = f"is deformed by a skeleton, and the target is only a part of its SkelRoot {root.GetPath()}"
        do = f"apply {schema.TARGET_API} to the SkelRoot or above it"
        raise UnsupportedError(found, where=gprim.GetPath(), do=do)
