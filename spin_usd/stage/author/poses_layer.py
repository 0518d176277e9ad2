"""The layer of poses: the target's pose at each frame, and the frame's name, as time samples.

Time code i is frame i. The camera stands at the world's origin, looks along +Y and has +Z up.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd

from spin_usd.basics.arrays import Float
from spin_usd.geometry.transform import Transform
from spin_usd.scene.poses import PoseList
from spin_usd.stage.author.paths import TARGET, WORLD
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.conversion import quatd, vec3d
from spin_usd.stage.usd.layer_file import author_metadata, writing

FOLDER = "layers"
EVEN = 0.01  # of a step, by which times may be off even ones: stamps are rounded
T_WORLD_CAM = Transform(
    to="world", of="cam", rotation=np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), translation=np.zeros(3)
)


def poses_layer(poses: PoseList) -> Sdf.Layer:
    """Make an anonymous layer with an `over` for the world and one for the target. It is meant for a .usdc file."""
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    with Sdf.ChangeBlock():
        author_metadata(layer, default_prim=WORLD.name, frames=len(poses))
        world, target = Sdf.CreatePrimInLayer(layer, WORLD), Sdf.CreatePrimInLayer(layer, TARGET)
        _samples(world, schema.CAPTURE_FRAME, Sdf.ValueTypeNames.String, list(poses.names))
        _samples(world, schema.CAPTURE_SOURCE_FILE, Sdf.ValueTypeNames.String, list(poses.files))
        if poses.times is not None:
            _samples(world, schema.CAPTURE_TIME, Sdf.ValueTypeNames.Double, poses.times.tolist())
        if poses.epoch:
            epoch = Sdf.AttributeSpec(world, schema.CAPTURE_EPOCH, Sdf.ValueTypeNames.String, Sdf.VariabilityUniform)
            epoch.default = poses.epoch
        author_poses(target, poses)
    return layer


def author_clock(root: Path, times: Float) -> None:
    """Let a second of USD be one of the `times` (N,) in the stage at `root`, where they are one step apart: all layers
    of the stage that are used get so many time codes a second. Raises OutputError."""
    if len(times) < 2:
        return
    step = float(times[-1] - times[0]) / (len(times) - 1)
    if np.abs(times - times[0] - step * np.arange(len(times))).max() > EVEN * step:
        return
    own = (root.parent / FOLDER).resolve()
    stage = open_stage(root)  # which holds its layers
    for layer in stage.GetUsedLayers():
        file = Path(layer.realPath or "/")
        if file == root.resolve() or file.is_relative_to(own):
            layer.timeCodesPerSecond = layer.framesPerSecond = 1 / step
            with writing(file):
                layer.Save()


def author_poses(prim: Sdf.PrimSpec, poses: PoseList) -> None:
    """Author the `poses` of a target at time codes 0 to N - 1, and its rates where they are known."""
    author_pose_samples(prim, *target_in_world(poses))
    if poses.velocities is None or poses.angular_velocities is None:
        return
    apis = Sdf.TokenListOp.Create(prependedItems=[schema.MOTION_API])
    prim.SetInfo(Usd.Tokens.apiSchemas, apis)
    rates = (poses.velocities, np.degrees(poses.angular_velocities))
    for name, each in zip((schema.MOTION_VELOCITY, schema.MOTION_ANGULAR_VELOCITY), rates, strict=True):
        rows = T_WORLD_CAM.directions(each) + 0.0  # no negative zeros
        _samples(prim, name, Sdf.ValueTypeNames.Double3, [vec3d(row) for row in rows])


def author_pose_samples(prim: Sdf.PrimSpec, q: Float, t: Float, time_codes: Sequence[int] | None = None) -> None:
    """Author the quaternions (N, 4), scalar first, and the positions (N, 3) as the prim's pose at the time codes, 0 to
    N - 1 if not given."""
    _samples(prim, "xformOp:translate", Sdf.ValueTypeNames.Double3, [vec3d(row) for row in t], time_codes)
    _samples(prim, "xformOp:orient", Sdf.ValueTypeNames.Quatd, [quatd(row) for row in q], time_codes)
    order = Sdf.AttributeSpec(prim, "xformOpOrder", Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform)
    order.default = ["xformOp:translate", "xformOp:orient"]


def target_in_world(poses: PoseList) -> tuple[Float, Float]:
    """Return q_world_body (N, 4) and t_world_body (N, 3), metres, of T_world_cam @ T_cam_body."""
    w, x, y, z = poses.q_cam_body.T
    # The camera's own quaternion is (1, -1, 0, 0) / sqrt(2): this is its Hamilton product with (w, x, y, z).
    q = np.stack([w + x, x - w, y + z, z - y], -1) / math.sqrt(2)
    return by_short_ways(q), T_WORLD_CAM.directions(poses.t_cam_body) + 0.0  # no negative zeros


def by_short_ways(q: Float) -> Float:
    """Return the same rotations as the quaternions (N, 4), each with the sign that is nearer to the one before, so that
    USD's slerp turns the short way."""
    turns = np.sign((q[1:] * q[:-1]).sum(-1))
    turns[turns == 0] = 1
    return np.concatenate([q[:1], q[1:] * np.cumprod(turns)[:, None]])


def _samples(
    prim: Sdf.PrimSpec,
    name: str,
    kind: Sdf.ValueTypeName,
    values: list[object],
    time_codes: Sequence[int] | None = None,
) -> None:
    """Author one time sample for each time code, from 0 if not given; no attribute without values."""
    if not values:
        return
    attribute = Sdf.AttributeSpec(prim, name, kind)
    layer, path = prim.layer, attribute.path
    for time_code, value in zip(time_codes or range(len(values)), values, strict=True):
        layer.SetTimeSample(path, float(time_code), value)
