"""What the pictures of a stage just authored show: from its first picture, and the poses it was made of."""

from dataclasses import dataclass

import numpy as np

from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.scene.derived.lit_share import suns_of
from spin_usd.scene.derived.views import Views, views_of
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.source.poses import PoseList
from spin_usd.stage.read.stage_reader import StageReader

LIGHTS_READ = 1000  # pictures, of those whose light is their own, that are looked at: each takes about a millisecond


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """The target's surface as the stage composes it, and the views. grey: whether pictures are, though it is not."""

    mesh: Mesh
    views: Views
    grey: bool


def look_at(reader: StageReader, poses: PoseList) -> Look:
    """The stage of the `reader`, which was made of the `poses`. Raises StageError, UnsupportedError as a render
    would."""
    scene = reader.scene(reader.frames[0])
    if reader.light_is_still:
        suns = dict.fromkeys(range(len(poses)), suns_of(scene))
    else:
        some = np.unique(np.linspace(0, len(poses) - 1, min(LIGHTS_READ, len(poses))).astype(int)).tolist()
        suns = {i: suns_of(reader.scene(reader.frames[i])) for i in some}
    rotations = matrices_from_quaternions(poses.q_cam_body)
    mesh = scene.target.mesh
    found = views_of(mesh, scene.camera, poses.names, rotations, poses.t_cam_body, suns)
    return Look(mesh=mesh, views=found, grey=scene.target.coloured and scene.sensor.channels == "mono")
