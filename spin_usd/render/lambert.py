"""The preview's shading: every surface matt, every light a point far away, hard shadows, no light between surfaces.

Radiance is emission + sum over lights of irradiance x colour x cosine / pi: exact for matt dielectrics. What a preview
leaves out: gloss, clearcoat, the light's angular size and opacity. A metal, which has no matt part, is shown in its
own colour as if it were matt, so that it is not black.
"""

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.region import Region
from spin_usd.scene.material import Material
from spin_usd.scene.model import Mesh, Scene
from spin_usd.scene.surface import face_normals, shading_normals, surface_points

LIFT = 1e-5  # of the target's radius: shadow rays start this far above the surface; float32 is good to 1e-7 there
# Successive points of this step, modulo one, fill the unit square evenly: M. Roberts, "The unreasonable effectiveness
# of quasirandom sequences" (2018).
PLASTIC = 1.324717957244746
STEP = np.array([1 / PLASTIC, 1 / PLASTIC**2])


class Caster(Protocol):
    """What shading asks of a renderer."""

    def cast(self, scene: Scene, xy: Float) -> NDArray[np.int32]: ...

    def shadowed(self, mesh: Mesh, body: Float, to_light: Float) -> NDArray[np.bool_]: ...


def radiance(scene: Scene, caster: Caster, xy: Float) -> Float:
    """Linear radiance, W/m2/sr, and coverage (N, 4) along the camera's rays (x, y, 1) of `xy` (N, 2); 0 where they meet
    nothing."""
    rgba = np.zeros((len(xy), 4))
    face = caster.cast(scene, xy)
    hit = np.flatnonzero(face >= 0)
    if len(hit):
        _, body = surface_points(scene, face[hit], xy[hit])
        rgba[hit, :3] = _shade(scene, caster, face[hit], body)
        rgba[hit, 3] = 1
    return rgba


def _shade(scene: Scene, caster: Caster, face: NDArray[np.int32], body: Float) -> Float:
    mesh = scene.target.mesh
    material = mesh.face_material[face]
    colours = np.array([_matt_colour(m) for m in scene.target.materials])
    rgb = np.array([m.emissive_color for m in scene.target.materials])[material]
    normals = shading_normals(scene, face, body)
    lifted = body + LIFT * mesh.radius * face_normals(scene, face, body)
    for light in scene.lights:
        to_light = -scene.T_cam_body.inverse().directions(light.direction_cam)
        cosine = normals @ to_light
        lit = np.flatnonzero(cosine > 0)
        lit = lit[~caster.shadowed(mesh, lifted[lit], to_light)]
        rgb[lit] += np.array(light.irradiance) / np.pi * cosine[lit, None] * colours[material[lit]]
    return rgb


def _matt_colour(material: Material) -> Float:
    """(3,) in the metallic workflow a metal's colour is its diffuse colour, in the specular workflow its specular."""
    diffuse = np.array(material.diffuse_color)
    return np.maximum(diffuse, material.specular_color) if material.use_specular_workflow else diffuse


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
