"""Three keys per picture: content digests of exactly what labels, render and image depend on.

Equal keys mean equal results, so the work is done once.
"""

from dataclasses import dataclass

from spin_usd.arrays import digest
from spin_usd.scene.content import content
from spin_usd.scene.light_groups import in_unit_light
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
    """Decides the target's radiance in unit light: geometry, shading, materials, where light comes from, depth of
    field, shutter, samples and seed; not how strong or of what colour the lights are."""
    materials = [material.key for material in scene.target.materials]
    lights = in_unit_light(scene).scene.lights
    taking = content([lights, scene.environment.illuminating, scene.thin_lens, scene.shutter])
    return digest(
        geometry_key(scene, settings.renderer),
        scene.target.mesh.shading_key,
        [materials, taking, settings.samples, render_seed(scene, settings)],
    )


def exposure_key(scene: Scene, settings: RenderSettings) -> str:
    """Decides the image's numbers: radiance, lights as they are, what lies behind, optics, sensor and seed."""
    taking = content([scene.lights, scene.environment, scene.optics, scene.sensor])
    return digest(radiance_key(scene, settings), [taking, picture_seed(scene, settings)])


def render_seed(scene: Scene, settings: RenderSettings) -> int:
    """A 31-bit seed of this frame's render: from the dataset's seed and the frame's name, never from its neighbours.
    It is the same in all variants, which may share the render."""
    return _seed(settings.seed, scene.frame.name)


def picture_seed(scene: Scene, settings: RenderSettings) -> int:
    """A 31-bit seed of all that is drawn for this picture alone: the detector's noise, its back plate."""
    return _seed(settings.seed, scene.frame.name, scene.frame.variant)


def _seed(*of: int | str) -> int:
    return int(digest(list(of))[:8], 16) & 0x7FFFFFFF
