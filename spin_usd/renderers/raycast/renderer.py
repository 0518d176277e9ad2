"""The ray casting renderer: a preview of the image by Embree's rays, with no light transport.

Its shading: every surface diffuse, every light a point, hard shadows, no light between surfaces. Radiance is emission +
sum over lights of irradiance x colour x cosine / pi: exact for diffuse surfaces in distant light. Colours and emission
are textured, and cut-outs are not there. A preview lacks gloss, clearcoat, normal maps, opacity that is not a cut-out,
the light of planets.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.region import BAND_PIXELS, Region
from spin_usd.geometry.transform import Transform
from spin_usd.geometry.triangles import dot, lengths
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.faces import BodyFaces, by_body, groups_of, materials_of
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.derived.lookup import material_values
from spin_usd.scene.derived.shadows import RayCaster, in_shadow, lifted
from spin_usd.scene.derived.surface import geometric_normals, shading_normals, surface_points, weights_at
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import AreaLight, DistantLight, DomeLight, PointLight, RectLight, Shaping
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.target import Target

# Successive points of this step, modulo one, fill the unit square evenly: M. Roberts, "The unreasonable effectiveness
# of quasirandom sequences" (2018).
PLASTIC = 1.324717957244746
STEP = np.array([1 / PLASTIC, 1 / PLASTIC**2])
TINY = np.finfo(np.float64).tiny


class RaycastRenderer:
    """A preview picture: Lambert's law with hard shadows whose rays the `caster` casts."""

    name = "raycast"

    def __init__(self, *, caster: EmbreeCaster | None = None) -> None:
        self._caster = caster or EmbreeCaster()

    def radiance(self, scene: Scene, effort: Effort, *, seed: int) -> Radiance:
        """Return the preview: `effort.samples` rays spread over each pixel's square, one through its centre when it is
        1. It ignores thin lens and shutter: it is sharp."""
        region, samples = scene.picture_region, effort.samples
        picture = Radiance.dark(region, groups=LightGroups.of(scene).count)
        rng = np.random.default_rng(seed)
        for band in region.bands():
            rows = slice(band.y0 - region.y0, band.y1 - region.y0)
            groups, coverage = np.zeros((len(picture.groups), band.width * band.height, 3)), np.zeros(band.shape)
            size = band.width * band.height
            positions, together = sample_positions(band, samples, rng), max(BAND_PIXELS // max(size, 1), 1)
            while some := list(islice(positions, together)):
                light, there = radiance(scene, self._caster, scene.camera.normalised(np.concatenate(some)))
                for start in range(0, len(there), size):  # one after the other: sums round by their order
                    groups += light[:, start : start + size]
                    coverage += there[start : start + size].reshape(band.shape)
            picture.groups[:, rows] = (groups / samples).reshape(len(groups), *band.shape, 3)
            picture.coverage[rows] = coverage / samples
        return picture

    def versions(self) -> dict[str, str]:
        """Return the name and version of the ray caster."""
        return {"embreex": version("embreex")}

    def close(self) -> None:
        """Release the caster's data of the meshes."""
        self._caster.close()


@dataclass(frozen=True, kw_only=True, eq=False)
class Beam:
    """Light at N points."""

    to_light: Float
    """(3,) or (N, 3) unit, body axes."""
    irradiance: Float
    """(3,) or (N, 3) W/m2 of a plane that faces it."""
    distance: Float | None = None
    """(N,) metres to the light, None where it is far."""


def beam(light: DistantLight | AreaLight, T_cam_body: Transform, body: Float) -> Beam:
    """Return the light that arrives at the `body` points (N, 3).

    A distant light is itself without its angular size. An area light is a point at its centre that has the radiant
    intensity of the whole, by the projected area that its shape shows; a source never gives more than pi times its
    radiance.
    """
    T_body_cam = T_cam_body.inverse()
    if isinstance(light, DistantLight):
        return Beam(to_light=-T_body_cam.directions(light.direction_cam), irradiance=np.array(light.at_target))
    away = T_body_cam.points(light.T_cam_light.translation) - body
    distance = np.maximum(lengths(away), np.sqrt(TINY))
    to_light = away / distance[:, None]
    leaving = -T_cam_body.directions(to_light) @ light.T_cam_light.rotation
    solid_angle = light.projected_area(leaving) / distance**2
    if not isinstance(light, PointLight):
        solid_angle = np.minimum(solid_angle, np.pi)
    emission = _shaped(light.shaping, -leaving[:, 2]) * light.emission
    if isinstance(light, RectLight) and light.image is not None:
        emission = emission * light.image.pixels[..., :3].mean((0, 1), dtype=np.float64)
    return Beam(to_light=to_light, irradiance=solid_angle[:, None] * emission, distance=distance)


def mean_radiance(dome: DomeLight) -> Float:
    """Return (3,) mean over all directions, W/m2/sr; an image's rows weigh as much as their belts of the sphere.

    It is all that the preview shows of a dome: it arrives from all around without shadows.
    """
    radiance = np.array(dome.radiance)
    if dome.image is None:
        return radiance
    rows = dome.image.pixels[..., :3].mean(1, dtype=np.float64)
    weights = np.sin((np.arange(len(rows)) + 0.5) * np.pi / len(rows))
    return np.asarray(radiance * (weights @ rows) / weights.sum())


def _shaped(shaping: Shaping | None, cosine: Float) -> Float:
    """Return (N, 3) factor of the emission at `cosine` (N,) from the axis."""
    if shaping is None:
        return np.ones((len(cosine), 3))
    angle = np.arccos(np.clip(cosine, -1, 1))
    soft = np.clip((shaping.cone_angle - angle) / max(shaping.cone_angle * shaping.softness, TINY), 0, 1)
    cone = soft**2 * (3 - 2 * soft) if shaping.softness > 0 else (angle < shaping.cone_angle).astype(float)
    tint = np.array(shaping.focus_tint)
    focus = np.abs(cosine[:, None]) ** shaping.focus
    return np.asarray(cone[:, None] * (tint + focus * (1 - tint)))


def radiance(scene: Scene, caster: RayCaster, xy: Float) -> tuple[Float, Float]:
    """Return the linear radiance (G, N, 3) by the scene's light groups, W/m2/sr, and coverage (N,) along the camera's
    rays (x, y, 1) of `xy` (N, 2); 0 where they meet nothing."""
    groups = LightGroups.of(scene)
    planes, coverage = np.zeros((groups.count, len(xy), 3)), np.zeros(len(xy))
    for of in by_body(scene, caster.cast(scene, xy)):
        _, body = surface_points(of.alone, of.face, xy[of.rows])
        for plane, rgb in zip(planes, _shade(scene, groups, caster, of, body), strict=True):
            plane[of.rows] = rgb
        coverage[of.rows] = 1
    return planes, coverage


def _shade(scene: Scene, groups: LightGroups, caster: RayCaster, of: BodyFaces, body: Float) -> Iterator[Float]:
    """Yield (N, 3) of each of the groups, at the points `body` (N, 3) on the faces of one body."""
    one, face = of.alone, of.face
    target = one.target
    weights = weights_at(target.mesh, face, body)
    colours = _diffuse_colours(target, face, weights)
    normals = shading_normals(one, face, body, weights)
    above = lifted(target.mesh, body, geometric_normals(one, face))
    for light in (scene.lights[index] for index in groups.placed):
        assert not isinstance(light, DomeLight)
        arriving = beam(light, one.T_cam_body, body)
        yield _lambert(scene, caster, light, arriving, of, normals, above) * colours
    if groups.surroundings:
        yield colours * sum(mean_radiance(light) for light in scene.lights if isinstance(light, DomeLight))
    if groups.emission:
        yield material_values(target, "emissive_color", face, weights)


def _lambert(
    scene: Scene,
    caster: RayCaster,
    light: DistantLight | AreaLight,
    arriving: Beam,
    of: BodyFaces,
    normals: Float,
    above: Float,
) -> Float:
    """Return (N, 3) radiance of white diffuse points on a body's faces (N,), whose shadow rays start `above` them
    (N, 3)."""
    cosine = dot(normals, arriving.to_light)
    lit = cosine > 0
    if light.lights is not None:
        lit &= np.isin(groups_of(of.alone.target.mesh, of.face), list(light.lights))
    if light.shadows:
        some = np.flatnonzero(lit)
        to_light = arriving.to_light if arriving.to_light.ndim == 1 else arriving.to_light[some]
        distance = None if arriving.distance is None else arriving.distance[some]
        lit[some] = ~in_shadow(scene, of.alone, above[some], to_light, caster, distance, light.shadowed_by)
    return arriving.irradiance / np.pi * np.where(lit, cosine, 0)[:, None]


def _diffuse_colours(target: Target, face: NDArray[np.int32], weights: Float) -> Float:
    """Return (N, 3) diffuse colours: in the metallic workflow a metal's colour is its diffuse colour, in the specular
    workflow its specular. A metal has no diffuse part; it is shown as if its own colour were one, so that it is not
    black."""
    diffuse = material_values(target, "diffuse_color", face, weights)
    specular = np.array([m.use_specular_workflow for m in target.materials])[materials_of(target.mesh, face)]
    of = np.flatnonzero(specular)
    if len(of):
        diffuse[of] = np.maximum(diffuse[of], material_values(target, "specular_color", face[of], weights[of]))
    return diffuse


def sample_positions(region: Region, samples: int, rng: np.random.Generator) -> Iterator[Float]:
    """`samples` times the pixel coordinates (N, 2) of one ray for each pixel of `region`, row by row.

    Each pixel's samples fill its square evenly, shifted by its own random amount (Cranley and Patterson, 1976).
    """
    v, u = np.mgrid[region.y0 : region.y1, region.x0 : region.x1]
    corner = np.stack([u, v], -1).reshape(-1, 2)
    if samples == 1:
        yield corner + 0.5
        return
    shift = rng.random(corner.shape)
    for i in range(samples):
        moved = shift + i * STEP
        yield corner + (moved - np.floor(moved))  # exact, as the remainder, which takes far longer
