"""The layer of poses: USD's own transforms give back the list, and its interpolation turns the short way."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom
from scipy.spatial.transform import Rotation, Slerp

from spin_usd.basics.arrays import Float
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.geometry.transform import Transform
from spin_usd.scene.poses import PoseList
from spin_usd.stage.author.poses_layer import T_WORLD_CAM, poses_layer, target_in_world

DOUBLE = 1e-14  # a product of two unit quaternions, relative
HALFWAY = 1e-7  # radians: two ways to slerp, and acos


def random_poses(count: int, seed: int = 1) -> PoseList:
    rng = np.random.default_rng(seed)
    return PoseList(
        names=tuple(f"img{i:06d}" for i in range(count)),
        q_cam_body=Rotation.random(count, rng=rng).as_quat(scalar_first=True),
        t_cam_body=rng.uniform([-1, -1, 2], [1, 1, 10], (count, 3)),
    )


def stage_of(poses: PoseList) -> Usd.Stage:
    stage = Usd.Stage.Open(poses_layer(poses))
    for path in ("/World", "/World/Target"):
        stage.GetPrimAtPath(path).SetSpecifier(Sdf.SpecifierDef)
        stage.GetPrimAtPath(path).SetTypeName("Xform")
    return stage


def world_matrix(stage: Usd.Stage, time: float) -> Float:
    """(4, 4), column-vector convention."""
    cache = UsdGeom.XformCache(time)
    return np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath("/World/Target"))).T


def test_usd_composes_the_pose_that_the_list_gives() -> None:
    poses = random_poses(50)
    stage = stage_of(poses)
    for i, (q, t) in enumerate(zip(poses.q_cam_body, poses.t_cam_body, strict=True)):
        want = T_WORLD_CAM @ Transform.from_quaternion(to="cam", of="body", q=q, t=t)
        assert np.abs(world_matrix(stage, i) - want.matrix).max() < DOUBLE * 10  # metres, ranges up to 10


def test_neighbours_have_the_sign_for_which_usd_slerps_the_short_way() -> None:
    poses = random_poses(40)
    stage = stage_of(poses)
    q, _ = target_in_world(poses)
    assert ((q[1:] * q[:-1]).sum(1) >= 0).all()
    short = Slerp(np.arange(40), Rotation.from_quat(q, scalar_first=True))
    for time in np.arange(39) + 0.5:
        turned = Rotation.from_matrix(world_matrix(stage, time)[:3, :3])
        assert (turned * short(time).inv()).magnitude() < HALFWAY


def test_types_names_and_times_are_as_the_layout_says() -> None:
    poses = random_poses(5)
    stage = stage_of(poses)
    target = stage.GetPrimAtPath("/World/Target")
    assert target.GetAttribute("xformOp:translate").GetTypeName() == Sdf.ValueTypeNames.Double3
    assert target.GetAttribute("xformOp:orient").GetTypeName() == Sdf.ValueTypeNames.Quatd
    frame = stage.GetPrimAtPath("/World").GetAttribute("spin:capture:frame")
    assert [frame.Get(time) for time in frame.GetTimeSamples()] == list(poses.names)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, 4)
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (24, 24)


def test_the_camera_looks_along_world_y_with_z_up() -> None:
    assert T_WORLD_CAM.directions([0, 0, 1]).tolist() == [0, 1, 0]
    assert T_WORLD_CAM.directions([0, -1, 0]).tolist() == [0, 0, 1]


@pytest.mark.parametrize("file", ["speedplus/synthetic_validation.json", "shirt/roe1.json"])
def test_whole_real_lists_come_back_from_the_crate_file(shared: Path, tmp_path: Path, file: str) -> None:
    poses = read_pose_list(shared / "data" / file)
    poses_layer(poses).Export(str(tmp_path / "poses.usdc"))
    stage = Usd.Stage.Open(str(tmp_path / "poses.usdc"))
    target = stage.GetPrimAtPath("/World/Target")
    orient, translate = (target.GetAttribute(f"xformOp:{name}") for name in ("orient", "translate"))
    assert orient.GetNumTimeSamples() == translate.GetNumTimeSamples() == len(poses)
    to_cam = Gf.Quatd(*T_WORLD_CAM.inverse().quaternion)
    for i in range(0, len(poses), 97):
        turned = to_cam * orient.Get(i)
        q = np.array([turned.GetReal(), *turned.GetImaginary()])
        assert min(np.abs(q - s * poses.q_cam_body[i]).max() for s in (1, -1)) < DOUBLE
        assert np.array_equal(T_WORLD_CAM.inverse().directions(np.array(translate.Get(i))), poses.t_cam_body[i])
