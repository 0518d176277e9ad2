"""The ray casting renderer: a preview of the image by Embree's rays, with no light transport."""

from importlib.metadata import version

import numpy as np

from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.raycast import lambert
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.effort import Effort
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Radiance


class RaycastRenderer:
    """A preview picture: Lambert's law with hard shadows (raycast.lambert), whose rays the `caster` casts."""

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
            for uv in lambert.sample_positions(band, samples, rng):
                light, there = lambert.radiance(scene, self._caster, scene.camera.normalised(uv))
                groups += light
                coverage += there.reshape(band.shape)
            picture.groups[:, rows] = (groups / samples).reshape(len(groups), *band.shape, 3)
            picture.coverage[rows] = coverage / samples
        return picture

    def versions(self) -> dict[str, str]:
        """Return the name and version of the ray caster."""
        return {"embreex": version("embreex")}

    def close(self) -> None:
        """Release what the caster made of the meshes."""
        self._caster.close()
