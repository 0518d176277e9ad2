"""All lights of a stage, at a time, in camera axes.

Light linking: which faces a light illuminates, and which of them cast its shadows.

USD computes the membership. Prims that every link treats alike form a group; a mesh's faces carry its number.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

from pxr import Sdf, Usd, UsdGeom, UsdLux

from spin_usd.errors import UnsupportedError
from spin_usd.scene.light import AreaLight, DistantLight, DomeLight, Light, Links
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.area_light import read_area_light
from spin_usd.stage.read.distant_light import direction_cam, read_distant_light
from spin_usd.stage.read.dome_light import is_dome, read_dome_light
from spin_usd.stage.read.emission import refuse_unsupported
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.prim_order import in_order
from spin_usd.stage.usd.time_variation import CameraSpaceCache, varying, visibility_varies
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import PROXIES, ancestors, is_always_invisible

AREA_LIGHTS = (UsdLux.SphereLight, UsdLux.DiskLight, UsdLux.RectLight, UsdLux.CylinderLight)
EVERY_PRIM = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)
LIGHTS, SHADOWED_BY = "lightLink", "shadowLink"
L = TypeVar("L", bound=AreaLight | DistantLight)


class LightReader:
    """Reads the lights of `stage`; `links` holds which geometry each of them lights.

    Raises UnsupportedError, with the light's path, for a light that is not supported.
    """

    def __init__(self, stage: Usd.Stage, images: Images) -> None:
        self._prims = find_lights(stage)
        self._cache = CameraSpaceCache(self._prims)
        self._images = images
        self._turning: dict[Sdf.Path, DistantLight] = {}
        self.links = LightLinks([prim for prim in self._prims if not is_dome(prim)], stage)

    @property
    def still(self) -> bool:
        """Return whether no light ever changes or moves in the world."""
        return self._cache.all_still

    def read(self, space: CameraSpace) -> tuple[Light, ...]:
        """Read the lights that are visible. They are the same tuple as long as the camera's pose is the same object and
        no light varies."""
        pose = space.T_world_usdcam
        found = (self._cache.read(prim, pose, partial(self._light, prim, space)) for prim in self._prims)
        return self._cache.same_tuple("lights", tuple(light for light in found if light is not None))

    def _light(self, prim: Usd.Prim, space: CameraSpace) -> Light | None:
        light = self._without_links(prim, space)
        return light if light is None or isinstance(light, DomeLight) else self.links.linked(light, prim)

    def _without_links(self, prim: Usd.Prim, space: CameraSpace) -> Light | None:
        """Read the light. Of a distant light that only turns the direction alone is read once the rest is known."""
        if known := self._turning.get(prim.GetPath()):
            return replace(known, direction_cam=direction_cam(prim, space.T_cam_world, space.world))
        light = read_light(prim, space, self._images)
        if isinstance(light, DistantLight) and _only_turns(prim):
            self._turning[prim.GetPath()] = light
        return light


def _only_turns(prim: Usd.Prim) -> bool:
    """Return whether nothing of a distant light can change in time but its direction."""
    return not varying(prim) and not any(visibility_varies(above) for above in ancestors(prim))


def read_light(prim: Usd.Prim, space: CameraSpace, images: Images) -> Light | None:
    """Read the light `prim` without its links; None where it is invisible."""
    if UsdGeom.Imageable(prim).ComputeVisibility(space.time) == UsdGeom.Tokens.invisible:
        return None
    if is_dome(prim):
        return read_dome_light(prim, space, images)
    if prim.IsA(UsdLux.DistantLight):
        return read_distant_light(prim, space.time, space.T_cam_world, space.world)
    return read_area_light(prim, space, images)


def find_lights(stage: Usd.Stage) -> tuple[Usd.Prim, ...]:
    """Find all lights of the stage that can be visible. Raises UnsupportedError for one that is not supported."""
    found = visible_lights(stage)
    for prim in found:
        refuse_light(prim)
    return found


def visible_lights(stage: Usd.Stage) -> tuple[Usd.Prim, ...]:
    """Find all lights of the stage that can be visible, supported or not."""
    lights = (prim for prim in Usd.PrimRange.Stage(stage, PROXIES) if prim.HasAPI(UsdLux.LightAPI))
    return tuple(in_order(p for p in lights if not any(is_always_invisible(each) for each in (*ancestors(p), p))))


def refuse_light(prim: Usd.Prim) -> None:
    """Raise UnsupportedError for a light that is not supported."""
    if not (is_dome(prim) or any(prim.IsA(kind) for kind in (UsdLux.DistantLight, *AREA_LIGHTS))):
        found = f"is a {prim.GetTypeName()} with LightAPI, which is not rendered"
        raise UnsupportedError(found, where=prim.GetPath(), do="replace it, or make it invisible or inactive")
    refuse_unsupported(prim)
    if is_dome(prim):
        refuse_links(prim)


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
