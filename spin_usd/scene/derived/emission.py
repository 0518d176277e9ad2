"""Compare how brightly a target's own light shows with what the Sun lights."""

from math import pi

import numpy as np

from spin_usd.scene.derived.lookup import extremes
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.model import Scene
from spin_usd.scene.texture import Primvar, Texture

DIM = 0.1
"""Of white in the Sun: an emission below it looks dark in a picture that is exposed for what the Sun lights."""


def dim_emissions(scene: Scene) -> tuple[str, ...]:
    """Return a sentence for each material that emits, and so little beside white in the Sun that it will hardly
    show."""
    suns = [light.at_target for light in scene.lights if isinstance(light, DistantLight)]
    white = float(np.sum(suns, axis=0).max()) / pi if suns else 0.0
    peaks = [(material.path, _peak(material, scene.target.mesh)) for material in scene.target.materials]
    return tuple(
        f"{path} emits at most {peak:.3g} W/m2/sr, {peak / white:.2g} of the {white:.3g} of a white surface in this "
        "stage's Sun, so it will look dark: raise its emissiveColor if it should be visible"
        for path, peak in peaks
        if 0 < peak < DIM * white
    )


def _peak(material: Material, mesh: Mesh) -> float:
    """Return the most that any band of the material emits, W/m2/sr."""
    value = material.emissive_color
    if isinstance(value, Texture):
        return float(extremes(value)[1].max())
    return float(np.max(mesh.primvars[value.name] if isinstance(value, Primvar) else value))
