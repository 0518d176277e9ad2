"""The deformations of gprims by skeletons at one time, found by UsdSkel's own library.

A prim is deformed only below a SkelRoot. Where there is no animation the skeleton is in its rest pose; one that has
neither, or no bind pose, moves nothing, and its gprims stay where they are authored.
"""

from dataclasses import dataclass, field

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.deformation import Deformation
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.visibility import PROXIES, ancestors


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
