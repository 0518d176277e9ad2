"""Three keys per picture: content digests of exactly what labels, render and image depend on.

Equal keys mean equal results, so the work is done once.
"""

from dataclasses import dataclass

from spin_usd.arrays import digest
from spin_usd.scene.model import Scene


@dataclass(frozen=True, kw_only=True)
class RenderSettings:
    """What a user can choose about a render. `samples` per pixel; `seed` of the dataset."""

    renderer: str
    samples: int
    seed: int


def geometry_key(scene: Scene, renderer: str) -> str:
    """Decides the labels: mesh, parts, pose, camera, and the renderer that resolves visibility."""
    pose = scene.T_cam_body
    return digest(renderer, scene.target.mesh.key, pose.rotation, pose.translation, scene.camera.key)


def radiance_key(scene: Scene, settings: RenderSettings) -> str:
    """Decides the linear radiance: geometry, shading, materials, lights, samples and seed."""
    materials = [material.key for material in scene.target.materials]
    lights = [[light.direction_cam, light.irradiance, light.angle] for light in scene.lights]
    return digest(
        geometry_key(scene, settings.renderer),
        scene.target.mesh.shading_key,
        [materials, lights, settings.samples, frame_seed(scene, settings)],
    )


def exposure_key(scene: Scene, settings: RenderSettings) -> str:
    """Decides the image's numbers: radiance and sensor."""
    sensor = scene.sensor
    return digest(radiance_key(scene, settings), [sensor.exposure, sensor.channels, sensor.bit_depth, sensor.encoding])


def frame_seed(scene: Scene, settings: RenderSettings) -> int:
    """A 31-bit seed of this picture alone: from the dataset's seed and the frame's name, never from its neighbours."""
    return int(digest([settings.seed, scene.frame.name])[:8], 16) & 0x7FFFFFFF
