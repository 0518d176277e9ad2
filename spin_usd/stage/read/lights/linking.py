"""Light linking: which faces a light illuminates, and which of them cast its shadows.

USD computes the membership. Prims that every link treats alike form a group; a mesh's faces carry its number.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from pxr import Usd, UsdGeom, UsdLux

from spin_usd.errors import UnsupportedError
from spin_usd.scene.light import AreaLight, DistantLight, Links
from spin_usd.stage.usd.values import read

EVERY_PRIM = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)
LIGHTS, SHADOWED_BY = "lightLink", "shadowLink"
L = TypeVar("L", bound=AreaLight | DistantLight)


class LightLinks:
    """The links between `lights` and the geometry of `stage`."""

    def __init__(self, lights: Sequence[Usd.Prim], stage: Usd.Stage) -> None:
        linked = [(prim, name) for prim in lights for name in (LIGHTS, SHADOWED_BY) if _is_linked(prim, name)]
        self._queries = {(prim.GetPath(), name): _query(prim, name) for prim, name in linked}
        prims = Usd.PrimRange.Stage(stage, EVERY_PRIM) if self._queries else ()
        memberships = sorted({self._membership(prim) for prim in prims if _has_faces(prim)})
        self._number = {membership: number for number, membership in enumerate(memberships)}

    def group_of(self, prim: Usd.Prim) -> int:
        """Return the number of the group to which the faces of the gprim or point instancer `prim` belong."""
        return self._number[self._membership(prim)] if self._queries else 0

    def linked(self, light: L, prim: Usd.Prim) -> L:
        """Add the groups that the light illuminates, and those that cast its shadows, to `light`, read from `prim`."""
        if not self._queries:
            return light
        return replace(light, lights=self._groups(prim, LIGHTS), shadowed_by=self._groups(prim, SHADOWED_BY))

    def _groups(self, prim: Usd.Prim, name: str) -> Links:
        """Return the groups of a link; None for all groups."""
        key = (prim.GetPath(), name)
        if key not in self._queries:
            return None
        index = list(self._queries).index(key)
        groups = frozenset(number for membership, number in self._number.items() if membership[index])
        return None if len(groups) == len(self._number) else groups

    def _membership(self, prim: Usd.Prim) -> tuple[bool, ...]:
        return tuple(bool(query.IsPathIncluded(prim.GetPath())) for query in self._queries.values())


def refuse_links(prim: Usd.Prim) -> None:
    """Raise UnsupportedError for a dome that is linked."""
    for name in (LIGHTS, SHADOWED_BY):
        if _is_linked(prim, name):
            found = f"is a {prim.GetTypeName()} linked by {name}"
            raise UnsupportedError(found, where=prim.GetPath(), do="let it light everything")


def _collection(prim: Usd.Prim, name: str) -> Usd.CollectionAPI:
    light = UsdLux.LightAPI(prim)
    return light.GetLightLinkCollectionAPI() if name == LIGHTS else light.GetShadowLinkCollectionAPI()


def _is_linked(prim: Usd.Prim, name: str) -> bool:
    """Return whether a collection is anything but "all", which is its default."""
    collection = _collection(prim, name)
    named = collection.GetIncludesRel().GetTargets() or collection.GetExcludesRel().GetTargets()
    expression = collection.GetMembershipExpressionAttr()
    return bool(named or not read(collection.GetIncludeRootAttr()) or (expression and expression.HasAuthoredValue()))


def _query(prim: Usd.Prim, name: str) -> Usd.UsdCollectionMembershipQuery:
    collection = _collection(prim, name)
    query = collection.ComputeMembershipQuery()
    expression = collection.GetMembershipExpressionAttr()
    if expression and expression.HasAuthoredValue():
        found = f"is linked by an expression in {name}"
        raise UnsupportedError(found, where=prim.GetPath(), do="use includes and excludes instead")
    for path in query.GetAsPathExpansionRuleMap():
        named = prim.GetStage().GetPrimAtPath(path.GetPrimPath())
        if named and named.IsA(UsdGeom.Subset):
            found = f"is linked by {name} to the subset {path}"
            raise UnsupportedError(found, where=prim.GetPath(), do="link it to whole gprims")
    return query


def _has_faces(prim: Usd.Prim) -> bool:
    return bool(prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer))
