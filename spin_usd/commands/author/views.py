"""Summarise what the pictures of a new stage show, from its first picture and its poses."""

from dataclasses import dataclass
from math import pi

import numpy as np

from spin_usd.basics.progress import Progress
from spin_usd.errors import SpinError
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.geometry.triangles import areas
from spin_usd.scene.derived.lookup import extremes
from spin_usd.scene.derived.views import ViewCollector, Views, suns_of, views_of
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.poses import PoseList
from spin_usd.scene.scene import Scene
from spin_usd.scene.texture import Primvar, Texture
from spin_usd.stage.read.stage_reader import StageReader

BLACK = (0.0, 0.0, 0.0)
METAL = 0.9  # metallic, of a material that scatters next to no light
MOSTLY = 0.9  # of the surface
LIGHTS_READ = 1000  # pictures, of those whose light is their own, of which the Sun is compared with the target
DIM = 0.1
"""Of white in sunlight: an emission below it looks dark in a picture exposed for sunlit surfaces."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ComposedTarget:
    """The target's surface as the stage composes it, and the views."""

    mesh: Mesh
    """The mesh of the first picture's target."""
    views: Views
    grey: bool
    """Whether pictures are, though it is not."""


def read_composed_target(reader: StageReader, poses: PoseList) -> ComposedTarget:
    """Read the target of the stage of the `reader`, which was made of the `poses` and shows it in all pictures. Raises
    StageError, UnsupportedError and GeometryError as a render would, of whichever of them."""
    frames, count = reader.frames, len(reader.frames)
    looked_at = {0} if reader.light_is_still else set(np.linspace(0, count - 1, min(LIGHTS_READ, count)).astype(int))
    suns = {}
    for i, frame in enumerate(frames):  # all, as a render does: any of them may be refused
        scene = reader.scene(frame)
        if i in looked_at:
            suns[i] = suns_of(scene)
    if reader.light_is_still:
        suns = dict.fromkeys(range(count), suns[0])
    scene = reader.scene(frames[0])
    rotations = matrices_from_quaternions(poses.q_cam_body)
    target = scene.bodies[0].target
    found = views_of(target.mesh, scene.camera, poses.names, rotations, poses.t_cam_body, suns)
    return ComposedTarget(mesh=target.mesh, views=found, grey=_is_grey(scene))


def read_targets_in_turn(reader: StageReader, progress: Progress) -> ComposedTarget:
    """Read the targets of the stage of the `reader`, each in the pictures that show it alone. Raises like
    read_composed_target."""
    collector, grey = ViewCollector(), False
    for done, frame in enumerate(reader.frames):
        progress("reading: picture", done, len(reader.frames))
        scene = reader.scene(frame)
        collector.add(scene)
        grey = grey or _is_grey(scene)
    views = collector.views()
    assert views
    return ComposedTarget(mesh=reader.scene(reader.frames[0]).bodies[0].target.mesh, views=views, grey=grey)


def _is_grey(scene: Scene) -> bool:
    """Return whether the picture of a coloured target is grey."""
    return scene.bodies[0].target.coloured and scene.sensor.channels == "mono"


def look_notes(reader: StageReader) -> tuple[str, ...]:
    """Return notes on a target that cannot be seen, on metal that shows black, and on light of its own that will not
    show."""
    frame = reader.frames[0]
    materials = reader.bodies.target_at(frame.time_code).materials
    if all(material.opacity == 0 for material in materials):
        return ("every material of the target has opacity 0: pictures show at most its reflections, labels all of it",)
    try:
        scene = reader.scene(frame)
    except SpinError:  # of the lights, which `check` and `render` report with all else that is wrong
        return ()
    dim = () if all(material.emissive_color == BLACK for material in materials) else dim_emissions(scene)
    return (*dim, *_metal_notes(scene))


def _metal_notes(scene: Scene) -> tuple[str, ...]:
    """Return a note where most of the first target is metal, and all light comes from points of the sky."""
    if scene.environment.illuminating or not all(isinstance(light, DistantLight) for light in scene.lights):
        return ()
    target = scene.bodies[0].target
    metal = [isinstance(m.metallic, float) and m.metallic > METAL and m.opacity == 1 for m in target.materials]
    of_material = np.zeros(len(metal))
    for shape in target.mesh.shapes:
        of_material += np.bincount(shape.face_material, areas(shape.points[shape.faces]), len(metal))
    share = of_material @ np.array(metal) / of_material.sum()
    if share <= MOSTLY:
        return ()
    return (
        f"{share:.0%} of the target's surface is metal (inputs:metallic above {METAL}), which is black but for "
        "highlights where the Sun is the only light: light it from around too (a DomeLight, --environment earth), or "
        "make it less metallic",
    )


def dim_emissions(scene: Scene) -> tuple[str, ...]:
    """Return a sentence for each material of the first target that emits, and so little beside white in the Sun that
    it will hardly show."""
    suns = [light.at_target for light in scene.lights if isinstance(light, DistantLight)]
    white = float(np.sum(suns, axis=0).max()) / pi if suns else 0.0
    target = scene.bodies[0].target
    peaks = [(material.path, _peak(material, target.mesh)) for material in target.materials]
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
