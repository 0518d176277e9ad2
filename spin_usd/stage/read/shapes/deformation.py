"""A skeleton's deformation of one gprim's points and normals: blend shapes, then skinning, both computed by UsdSkel."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdSkel, Vt

from spin_usd.arrays import Float
from spin_usd.errors import StageError
from spin_usd.stage.read.shapes.triangles import Int, unit
from spin_usd.stage.usd.values import read


@dataclass(frozen=True, kw_only=True, eq=False)
class Deformation:
    """A gprim under a skeleton at one time.

    joint_transforms: from the bind pose to the pose, for all the skeleton's joints; None where it lacks one of the two,
    so that only blend shapes act · shape_weights: of all the animation's blend shapes · T_own_skeleton: row-vector
    matrix from the skeleton's axes, in which UsdSkel places what it skins, to the gprim's own.
    """

    query: UsdSkel.SkinningQuery
    time: Usd.TimeCode
    joint_transforms: Vt.Matrix4dArray | None
    shape_weights: Sequence[float]
    T_own_skeleton: Gf.Matrix4d

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
