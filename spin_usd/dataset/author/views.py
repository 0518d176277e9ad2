"""Find what the pictures of a stage just authored show, from its first picture and the poses it was made of."""

from dataclasses import dataclass

import numpy as np

from spin_usd.errors import SpinError
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.scene.derived.emission import dim_emissions
from spin_usd.scene.derived.lit_share import suns_of
from spin_usd.scene.derived.views import Views, views_of
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.source.poses import PoseList
from spin_usd.stage.read.stage_reader import StageReader

BLACK = (0.0, 0.0, 0.0)
LIGHTS_READ = 1000  # pictures, of those whose light is their own, of which the Sun is compared with the target


@dataclass(frozen=True, kw_only=True, eq=False)
class ComposedTarget:
    """The target's surface as the stage composes it, and the views. grey: whether pictures are, though it is not."""

    mesh: Mesh
    views: Views
    grey: bool


def read_composed_target(reader: StageReader, poses: PoseList) -> ComposedTarget:
    """Read the target of the stage of the `reader`, which was made of the `poses`. Raises StageError, UnsupportedError
    and GeometryError as a render would, of whichever picture."""
    count = len(poses)
    looked_at = {0} if reader.light_is_still else set(np.linspace(0, count - 1, min(LIGHTS_READ, count)).astype(int))
    suns = {}
    for i, frame in enumerate(reader.frames):  # all, as a render does: any of them may be refused
        scene = reader.scene(frame)
        if i in looked_at:
            suns[i] = suns_of(scene)
    if reader.light_is_still:
        suns = dict.fromkeys(range(count), suns[0])
    scene = reader.scene(reader.frames[0])
    rotations = matrices_from_quaternions(poses.q_cam_body)
    mesh = scene.target.mesh
    found = views_of(mesh, scene.camera, poses.names, rotations, poses.t_cam_body, suns)
    return ComposedTarget(mesh=mesh, views=found, grey=scene.target.coloured and scene.sensor.channels == "mono")


def look_notes(reader: StageReader) -> tuple[str, ...]:
    """Return notes on a target that cannot be seen, and on light of its own that will not show."""
    frame = reader.frames[0]
    materials = reader.target_at(frame.time_code).materials
    if all(material.opacity == 0 for material in materials):
        return ("every material of the target has opacity 0: pictures show at most its reflections, labels all of it",)
    if all(material.emissive_color == BLACK for material in materials):
        return ()
    try:
        return dim_emissions(reader.scene(frame))
    except SpinError:  # of the lights, which `check` and `render` report with all else that is wrong
        return ()
