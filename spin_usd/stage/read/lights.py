"""All lights of a stage, at a time, in camera axes."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.light import (
    AreaLight,
    CylinderLight,
    DiskLight,
    DistantLight,
    DomeLight,
    Light,
    Links,
    PointLight,
    RectLight,
    SphereLight,
)
from spin_usd.scene.texture import Image
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.distant_light import direction_cam, read_distant_light
from spin_usd.stage.read.emission import casts_shadows, emission, read_shaping, refuse_shaping, refuse_unsupported
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.prim_order import in_order
from spin_usd.stage.usd.time_variation import CameraSpaceCache, varying, visibility_varies
from spin_usd.stage.usd.transforms import SHEAR_TOLERANCE, placement
from spin_usd.stage.usd.values import AT_LEAST_0, read, value_in
from spin_usd.stage.usd.visibility import PROXIES, ancestors, is_always_invisible

AREA_LIGHTS = (UsdLux.SphereLight, UsdLux.DiskLight, UsdLux.RectLight, UsdLux.CylinderLight)
EVERY_PRIM = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)
LIGHTS, SHADOWED_BY = "lightLink", "shadowLink"
L = TypeVar("L", bound=AreaLight | DistantLight)
MIDDLE_COLUMN = np.diag([-1.0, 1.0, -1.0])  # scene.light's dome has it along -z, USD's along +z
POLE_TO_Z = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # +y to +z, +z to -y
MIN_SIZE_M = 1e-9  # squared twice it is still above the smallest float32, 1e-38
POINT_AREA = 1.0  # for a sphere of radius 0: 4 pi times it emits as much as a point does
MAX_DISTANCE_M = 1e15  # a tenth of a light year; squared distances overflow float32 at 2e19 m
FILE, FORMAT = "inputs:texture:file", "inputs:texture:format"
LATLONG = ("automatic", "latlong")


class LightReader:
    """Reads the lights of `stage`; `links` holds which geometry each of them lights.

    Raises UnsupportedError, with the light's path, for a light that is not supported.
    """

    def __init__(self, stage: Usd.Stage, images: Images) -> None:
        self._prims = find_lights(stage)
        self._cache = CameraSpaceCache(self._prims)
        self._images = images
        self._only_turn = {prim.GetPath() for prim in self._prims if _only_turns(prim)}
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
        if isinstance(light, DistantLight) and prim.GetPath() in self._only_turn:
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
    """The links between `lights` and the geometry of `stage`: which faces a light illuminates, which cast its shadows.

    USD computes the membership. Prims that every link treats alike form a group; a mesh's faces carry its number.
    """

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
        """Add the groups that the light illuminates, and the groups that cast its shadows, to `light`, read from
        `prim`."""
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


def is_dome(prim: Usd.Prim) -> bool:
    """Return whether the prim is a dome light."""
    return bool(prim.IsA(UsdLux.DomeLight) or prim.IsA(UsdLux.DomeLight_1))


def read_dome_light(prim: Usd.Prim, space: CameraSpace, images: Images) -> DomeLight:
    """Read the light, in camera axes. Raises StageError, UnsupportedError.

    Images of domes, UsdLux.DomeLight and DomeLight_1, are latitude-longitude as OpenEXR defines it: the top row is the
    pole +y, the middle column +z, and +x lies a quarter of the width left of that. DomeLight_1 may start with its pole
    along +z instead, the middle column along -y. Normalisation does not apply to a dome. Source: UsdLux's schema text
    on DomeLight_1 and on LightAPI's normalize.
    """
    time = space.time
    refuse_shaping(prim, time, np.pi)
    if not casts_shadows(prim, time):
        raise UnsupportedError("is a dome without shadows", where=prim.GetPath(), do="enable its shadows")
    matrix = space.world.GetLocalToWorldTransform(prim)
    matrix.SetTranslateOnly((0, 0, 0))  # a dome is infinitely far
    T_world_usd = placement(matrix, frame="usd dome", metres=1.0, where=prim.GetPath()).transform
    T_usd_dome = Transform(to="usd dome", of="dome", rotation=_pole(prim) @ MIDDLE_COLUMN, translation=np.zeros(3))
    axes = space.T_cam_world @ T_world_usd @ T_usd_dome
    return DomeLight(
        path=str(prim.GetPath()),
        T_cam_dome=Transform(to="cam", of="dome", rotation=axes.rotation, translation=np.zeros(3)),
        radiance=emission(prim, time, 1.0),
        image=read_texture(prim, time, images),
    )


def _pole(prim: Usd.Prim) -> Float:
    """Return the rotation (3, 3) that takes the pole from +y to where DomeLight_1 starts."""
    axis = read(UsdLux.DomeLight_1(prim).GetPoleAxisAttr()) if prim.IsA(UsdLux.DomeLight_1) else "Y"
    axis = UsdGeom.GetStageUpAxis(prim.GetStage()) if axis == "scene" else axis
    return POLE_TO_Z if axis == "Z" else np.eye(3)


def read_area_light(prim: Usd.Prim, space: CameraSpace, images: Images) -> AreaLight:
    """Read the light, in camera axes. Raises StageError, UnsupportedError.

    Spheres, disks, rectangles and cylinders are read as radiance, size and pose. Normalised, their emission is divided
    by the surface that emits, in the stage's units of area, with all scaling: a sphere's 4 pi r2, a disk's and a
    rectangle's one side, a cylinder's mantle without its ends (which emit nothing). Source: UsdLux's schema text on
    LightAPI's normalize, "Area Lights"; hdEmbree.
    """
    time = space.time
    T_world_light, scale = _axes(prim, space.world, space.metres)
    unlit = _unlit(prim, time, scale, space.from_world(T_world_light))
    lit = replace(
        unlit.scaled(space.metres),
        emission=emission(prim, time, unlit.area or POINT_AREA),
        shaping=read_shaping(prim, time),
        shadows=casts_shadows(prim, time),
    )
    if isinstance(lit, RectLight):
        lit = replace(lit, image=read_texture(prim, time, images))
    _check_float32(lit)
    return _point(lit, prim, time) if isinstance(lit, SphereLight) else lit


def _check_float32(light: AreaLight) -> None:
    """Raise UnsupportedError for a size or a distance that float32 cannot carry."""
    distance, size = float(np.linalg.norm(light.T_cam_light.translation)), max(light.size)
    for name, value in (("distance from the camera", distance), ("size", size)):
        if not value <= MAX_DISTANCE_M:
            found = f"its {name} is {value:g} m, more than {MAX_DISTANCE_M:g} m"
            raise UnsupportedError(found, where=light.path, do="use a DistantLight")
    if 0 < min(light.size) < MIN_SIZE_M:
        found = f"its size is {min(light.size):g} m, less than {MIN_SIZE_M:g} m"
        raise UnsupportedError(found, where=light.path, do="make it larger, or a SphereLight of radius 0")


def _unlit(prim: Usd.Prim, time: Usd.TimeCode, scale: Float, T_cam_light: Transform) -> AreaLight:
    """Read the light without its emission, its lengths in stage units, scaled."""
    x, y, _ = scale
    common: dict[str, Any] = {"path": str(prim.GetPath()), "T_cam_light": T_cam_light, "emission": (0.0, 0.0, 0.0)}
    light: AreaLight
    if prim.IsA(UsdLux.RectLight):
        width, height = _length(prim, "inputs:width", time), _length(prim, "inputs:height", time)
        light = RectLight(width=width * x, height=height * y, **common)
    elif prim.IsA(UsdLux.DiskLight):
        radius = _length(prim, "inputs:radius", time)
        light = DiskLight(radius_x=radius * x, radius_y=radius * y, **common)
    elif prim.IsA(UsdLux.CylinderLight):
        length, radius = _length(prim, "inputs:length", time), _length(prim, "inputs:radius", time)
        light = CylinderLight(length=length * x, radius=radius * _equal(scale[1:], prim), **common)
    else:
        return SphereLight(radius=_length(prim, "inputs:radius", time) * _equal(scale, prim), **common)
    if min(light.size) == 0:
        raise StageError("has no surface that could emit", where=prim.GetPath(), do="give it a size above 0")
    return light


def _length(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> float:
    return float(value_in(prim, name, AT_LEAST_0, time))


def _point(light: SphereLight, prim: Usd.Prim, time: Usd.TimeCode) -> AreaLight:
    """Turn a sphere that is treated as a point into one that is as bright from afar; also a normalised one of radius
    0."""
    radius, normalized = light.radius, read(UsdLux.LightAPI(prim).GetNormalizeAttr(), time)
    if radius > 0 and not read(UsdLux.SphereLight(prim).GetTreatAsPointAttr(), time):
        return light
    if radius == 0 and not normalized:
        do = "give it a radius, or set inputs:normalize"
        raise StageError("has no surface that could emit", where=prim.GetPath(), do=do)
    visible_area = light.facing_area if radius > 0 else 1 / 4  # a sphere shows a disk, a quarter of its 4 pi r2
    r, g, b = (float(value * visible_area) for value in light.emission)
    return PointLight(
        path=light.path,
        T_cam_light=light.T_cam_light,
        emission=(r, g, b),
        shaping=light.shaping,
        shadows=light.shadows,
    )


def _axes(prim: Usd.Prim, world: UsdGeom.XformCache, metres: float) -> tuple[Transform, Float]:
    """Return the light's axes in the world, and the scale (3,) along them. Raises StageError for shear or a mirror."""
    matrix = np.array(world.GetLocalToWorldTransform(prim))
    linear, where = matrix[:3, :3].T, prim.GetPath()
    scale = np.linalg.norm(linear, axis=0)
    if not np.isfinite(matrix).all() or scale.min() == 0 or np.linalg.det(linear / scale.max()) <= 0:
        raise StageError("its transform is mirrored, flat or not finite", where=where, do="give it a plain rotation")
    axes = linear / scale
    if np.abs(axes.T @ axes - np.eye(3)).max() > SHEAR_TOLERANCE:
        raise StageError("its transform shears it", where=where, do="scale it by its own size instead")
    u, _, vt = np.linalg.svd(axes)
    return Transform(to="world", of="light", rotation=u @ vt, translation=matrix[3, :3] * metres), scale


def _equal(scale: Float, prim: Usd.Prim) -> float:
    """Return the scale factor of a round light. Raises UnsupportedError where the factors differ."""
    if scale.max() - scale.min() > SHEAR_TOLERANCE * scale.max():
        found = f"is a {prim.GetTypeName()} scaled unequally (by {scale.max() / scale.min():.6g})"
        raise UnsupportedError(found, where=prim.GetPath(), do="scale it equally: only round ones are rendered")
    return float(scale.mean())


def read_texture(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> Image | None:
    """Read the image in linear colours; the file's own colour space decides. Raises StageError, UnsupportedError."""
    attribute = prim.GetAttribute(FILE)
    asset: Sdf.AssetPath | None = read(attribute, time) if attribute else None
    if asset is None or not asset.path:
        return None
    layout = prim.GetAttribute(FORMAT)
    if layout and read(layout, time) not in LATLONG:
        found = f"its texture is a {read(layout, time)}"
        raise UnsupportedError(found, where=prim.GetPath(), do="convert it to latitude and longitude")
    return images.read(asset, "auto", prim).image
