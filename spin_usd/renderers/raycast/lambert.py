"""The preview's shading: every surface diffuse, every light a point, hard shadows, no light between surfaces.

Radiance is emission + sum over lights of irradiance x colour x cosine / pi: exact for diffuse surfaces in distant
light. Colours and emission are textured, and cut-outs are not there. A preview lacks gloss, clearcoat, normal maps,
opacity that is not a cut-out, the light of planets. Area lights are points (see raycast.preview_light); a dome's light
arrives from all around without shadows. A metal, which has no diffuse part, is shown in its own colour as if it were
diffuse, so that it is not black.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.region import Region
from spin_usd.renderers.raycast.preview_light import Beam, beam, mean_radiance
from spin_usd.scene.derived.body_faces import BodyFaces, by_body
from spin_usd.scene.derived.faces import groups_of, materials_of
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.derived.lookup import material_values
from spin_usd.scene.derived.shadows import RayCaster, in_shadow, lifted
from spin_usd.scene.derived.surface import geometric_normals, shading_normals, surface_points, weights_at
from spin_usd.scene.light import AreaLight, DistantLight, DomeLight
from spin_usd.scene.model import Scene
from spin_usd.scene.target import Target

# Successive points of this step, modulo one, fill the unit square evenly: M. Roberts, "The unreasonable effectiveness
# of quasirandom sequences" (2018).
PLASTIC = 1.324717957244746
STEP = np.array([1 / PLASTIC, 1 / PLASTIC**2])


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
    normals = shading_normals(one, face, body)
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
    cosine = (normals * arriving.to_light).sum(1)
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
    workflow its specular."""
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
        yield corner + (shift + i * STEP) % 1
