"""Three keys per picture: content digests of exactly what labels, render and image depend on.

Equal keys mean equal results, so the work is done once.
"""

from dataclasses import dataclass

from spin_usd.arrays import digest
from spin_usd.scene.content import content
from spin_usd.scene.model import Scene


@dataclass(frozen=True, kw_only=True)
class RenderSettings:
    """What a user can choose about a render. `samples` per pixel; `seed` of the dataset."""

    renderer: str
    samples: int
    seed: int


def geometry_key(scene: Scene, renderer: str) -> str:
    """Decides the labels: mesh, parts, cut-outs, pose, camera, and the renderer that resolves visibility."""
    target, pose = scene.target, scene.T_cam_body
    return digest(renderer, target.mesh.key, target.cut_out_key, pose.rotation, pose.translation, scene.camera.key)


def radiance_key(scene: Scene, settings: RenderSettings) -> str:
    """Decides the target's linear radiance: geometry, shading, materials, lights and whatever else lights it, depth of
    field, shutter, samples and seed."""
    materials = [material.key for material in scene.target.materials]
    taking = content([scene.lights, scene.environment.planets, scene.thin_lens, scene.shutter])
    return digest(
        geometry_key(scene, settings.renderer),
        scene.target.mesh.shading_key,
        [materials, taking, settings.samples, frame_seed(scene, settings)],
    )


def exposure_key(scene: Scene, settings: RenderSettings) -> str:
    """Decides the image's numbers: radiance, what lies behind, optics and sensor."""
    return digest(radiance_key(scene, settings), content([scene.environment, scene.optics, scene.sensor]))


def frame_seed(scene: Scene, settings: RenderSettings) -> int:
    """A 31-bit seed of this picture alone: from the dataset's seed and the frame's name, never from its neighbours."""
    return int(digest([settings.seed, scene.frame.name])[:8], 16) & 0x7FFFFFFF
