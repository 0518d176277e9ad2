"""Skinned meshes against UsdSkel.BakeSkinning, and against rigid motions, which need no authority."""

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.derived.content_keys import geometry_key
from spin_usd.stage.read.stage_reader import StageReader

TUBE = "/World/Target/Arm/Tube"
SKELETON = "/World/Target/Arm/Skel"
TIMES = "metersPerUnit = 1\nstartTimeCode = 0\nendTimeCode = 2"
ARM = """
def SkelRoot "Arm"
{
    def Skeleton "Skel" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {
        uniform token[] joints = ["base", "base/tip"]
        uniform matrix4d[] bindTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 2, 1))]
        uniform matrix4d[] restTransforms = [
            ((0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 2, 1))]
        rel skel:animationSource = </World/Target/Arm/Bend>
        double3 xformOp:translate = (0, 0.5, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def SkelAnimation "Bend"
    {
        uniform token[] joints = ["base/tip"]
        float3[] translations = [(0, 0, 2)]
        quatf[] rotations.timeSamples = {
            0: [(1, 0, 0, 0)],
            2: [(0.70710678, 0.70710678, 0, 0)],
        }
        half3[] scales = [(1, 1.5, 1)]
        uniform token[] blendShapes = ["fat", "lean"]
        float[] blendShapeWeights.timeSamples = {
            0: [0, 0],
            2: [0.5, 1],
        }
    }
    def Mesh "Tube" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {
        uniform token subdivisionScheme = "none"
        rel skel:skeleton = </World/Target/Arm/Skel>
        uniform token[] skel:blendShapes = ["lean", "fat"]
        rel skel:blendShapeTargets = [</World/Target/Arm/Tube/Lean>, </World/Target/Arm/Tube/Fat>]
        double3 xformOp:translate = (0, 0, 7)
        float xformOp:rotateX = 20
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
        def BlendShape "Fat"
        {
            uniform vector3f[] offsets = [(-1, 0, 0), (0, 0.25, 0)]
            uniform vector3f[] normalOffsets = [(-1, 0, 0.5), (0, 0.5, 0)]
            uniform int[] pointIndices = [3, 40]
        }
        def BlendShape "Lean"
        {
        }
    }
}
"""
RINGS, SIDES = 9, 8


def tube(stage):
    """Fill the mesh: a tube along z, 4 long, whose points belong more to the tip the farther up they are."""
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(TUBE))
    z, angle = (each.reshape(-1) for each in np.meshgrid(np.linspace(0, 4, RINGS), np.arange(SIDES), indexing="ij"))
    round_it = np.stack([np.cos(angle * 2 * np.pi / SIDES), np.sin(angle * 2 * np.pi / SIDES), 0 * z], 1)
    ring, side = (each.reshape(-1) for each in np.meshgrid(np.arange(RINGS - 1), np.arange(SIDES), indexing="ij"))
    after = (side + 1) % SIDES
    quads = np.stack([ring * SIDES + side, ring * SIDES + after, (ring + 1) * SIDES + after, (ring + 1) * SIDES + side])
    mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy((0.3 * round_it + [0, 0, 1] * z[:, None]).astype(np.float32)))
    mesh.GetFaceVertexCountsAttr().Set([4] * len(ring))
    mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(quads.T.reshape(-1).astype(np.int32)))
    mesh.GetNormalsAttr().Set(Vt.Vec3fArray.FromNumpy(round_it.astype(np.float32)))
    mesh.SetNormalsInterpolation("vertex")
    binding = UsdSkel.BindingAPI(mesh)
    share = np.clip((z - 1) / 2, 0, 1)
    binding.CreateJointIndicesPrimvar(False, 2).Set([0, 1] * len(z))
    binding.CreateJointWeightsPrimvar(False, 2).Set(np.stack([1 - share, share], 1).reshape(-1).tolist())
    binding.CreateGeomBindTransformAttr().Set(Gf.Matrix4d(1).SetTranslate((0, 0, 0.25)))
    lean = UsdSkel.BlendShape(stage.GetPrimAtPath(f"{TUBE}/Lean"))
    lean.CreateOffsetsAttr([(0, 0.1 * height, 0) for height in z])
    return mesh


@pytest.fixture
def arm(make_stage):
    """Write the arm's stage, changed by `change(stage)`; returns its path."""

    def make(change=lambda stage: None, *, geometry=ARM, name="arm.usda"):
        path = make_stage(geometry, metadata=TIMES, name=name)
        stage = Usd.Stage.Open(str(path))
        tube(stage)
        change(stage)
        stage.GetRootLayer().Save()
        return path

    return make


def meshes(path):
    reader = StageReader(path)
    return [reader.scene(frame).bodies[0].target.mesh for frame in reader.frames]


def baked(path):
    """The same stage, its skinning baked by UsdSkel."""
    stage = Usd.Stage.Open(Usd.Stage.Open(str(path)).Flatten())
    assert UsdSkel.BakeSkinning(UsdSkel.Root(stage.GetPrimAtPath("/World/Target/Arm")), Gf.Interval(0, 2))
    copy = path.with_name("baked.usda")
    stage.GetRootLayer().Export(str(copy))
    return copy


def face_varying_normals(stage) -> None:
    stage.GetPrimAtPath(f"{TUBE}/Fat").RemoveProperty(
        "normalOffsets"
    )  # baking leaves them out where a face has its own
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(TUBE))
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get())
    mesh.GetNormalsAttr().Set(Vt.Vec3fArray.FromNumpy(np.array(mesh.GetNormalsAttr().Get())[indices]))
    mesh.SetNormalsInterpolation("faceVarying")


def subdivided(stage) -> None:
    UsdGeom.Mesh(stage.GetPrimAtPath(TUBE)).GetSubdivisionSchemeAttr().Set("catmullClark")


def dual_quaternion(stage) -> None:
    UsdSkel.BindingAPI(stage.GetPrimAtPath(TUBE)).CreateSkinningMethodAttr("dualQuaternion")


def only_one_joint(stage) -> None:
    UsdSkel.BindingAPI(stage.GetPrimAtPath(TUBE)).SetRigidJointInfluence(1)


def own_joints(stage) -> None:
    UsdSkel.BindingAPI(stage.GetPrimAtPath(TUBE)).CreateJointsAttr(["base/tip", "base"])


def without_animation(stage) -> None:
    stage.GetPrimAtPath(SKELETON).GetRelationship("skel:animationSource").ClearTargets(True)


CHANGES = [
    lambda stage: None,
    face_varying_normals,
    subdivided,
    dual_quaternion,
    only_one_joint,
    own_joints,
    without_animation,
]


@pytest.mark.parametrize("change", CHANGES)
def test_each_picture_has_the_pose_that_usd_bakes(arm, change) -> None:
    path = arm(change)
    posed, authority = meshes(path), meshes(baked(path))
    for own, other in zip(posed, authority, strict=True):
        np.testing.assert_allclose(own.points, other.points, atol=1e-5)  # of 4 m: float32
        np.testing.assert_allclose(own.corner_normals, other.corner_normals, atol=1e-5)
    # without its skeleton the arm is elsewhere, so the comparison can fail
    assert np.abs(posed[-1].points - authored(path).points).max() > 1


def authored(path):
    stage = Usd.Stage.Open(str(path))
    stage.GetPrimAtPath("/World/Target/Arm").SetTypeName("Xform")
    stage.GetRootLayer().Export(str(path.with_name("unbound.usda")))
    return meshes(path.with_name("unbound.usda"))[0]


def test_equal_poses_are_one_shape_and_others_are_not(arm) -> None:
    reader = StageReader(arm())
    first, second, third = (reader.scene(frame) for frame in reader.frames)
    assert first.bodies[0].target is not second.bodies[0].target
    assert len({geometry_key(scene) for scene in (first, second, third)}) == 3
    still = StageReader(arm(without_animation, name="still.usda"))
    first, second, third = (still.scene(frame) for frame in still.frames)
    assert first.bodies[0].target is second.bodies[0].target is third.bodies[0].target


def test_only_the_animation_moves_the_shape(arm) -> None:
    """Nothing below the target varies: the animation lies outside it."""

    def elsewhere(stage) -> None:
        moved = Sdf.CopySpec(stage.GetRootLayer(), "/World/Target/Arm/Bend", stage.GetRootLayer(), "/World/Bend")
        stage.RemovePrim("/World/Target/Arm/Bend")
        stage.GetPrimAtPath(SKELETON).GetRelationship("skel:animationSource").SetTargets(["/World/Bend"])
        assert moved

    first, second, _ = meshes(arm(elsewhere))
    assert np.abs(first.points - second.points).max() > 0.5


def test_instances_of_one_model_with_poses_of_their_own(make_stage, arm) -> None:
    two = """
    def Xform "{name}"
    {{
        def SkelRoot "Arm" (
            instanceable = true
            prepend references = @./model.usda@</World/Target/Arm>
            prepend apiSchemas = ["SkelBindingAPI"]
        )
        {{
            {animation}
        }}
    }}"""
    turn = """
    def SkelAnimation "Turn"
    {
        uniform token[] joints = ["base"]
        float3[] translations = [(0, 0, 9)]
        quatf[] rotations = [(1, 0, 0, 0)]
        half3[] scales = [(1, 1, 1)]
    }"""
    own = "rel skel:animationSource = </World/Target/Turn>"

    def unbound(stage) -> None:
        stage.GetPrimAtPath(SKELETON).RemoveProperty("skel:animationSource")

    arm(unbound, name="model.usda")
    geometry = turn + two.format(name="A", animation=own) + two.format(name="B", animation="")
    (mesh,) = meshes(make_stage(geometry))
    count = RINGS * SIDES
    assert mesh.points[:count, 2].min() == pytest.approx(mesh.points[count:, 2].min() + 9, abs=1e-5)


def test_a_shape_without_points_moves_as_a_whole(arm) -> None:
    def with_box(stage) -> None:
        box = UsdGeom.Cube.Define(stage, "/World/Target/Arm/Box")
        box.GetSizeAttr().Set(0.5)
        binding = UsdSkel.BindingAPI.Apply(box.GetPrim())
        binding.CreateSkeletonRel().SetTargets([SKELETON])
        binding.SetRigidJointInfluence(1)

    path = arm(with_box)
    for own, other in zip(meshes(path), meshes(baked(path)), strict=True):
        np.testing.assert_allclose(own.points, other.points, atol=1e-5)


def test_without_a_skel_root_nothing_is_deformed(arm) -> None:
    path = arm(lambda stage: stage.GetPrimAtPath("/World/Target/Arm").SetTypeName("Xform"))
    first, second, _ = meshes(path)
    assert first is second


def test_what_does_not_fit(arm) -> None:
    def too_few(stage) -> None:
        UsdSkel.BindingAPI(stage.GetPrimAtPath(TUBE)).GetJointWeightsPrimvar().Set([1.0, 0.0])

    def part(stage) -> None:
        stage.GetPrimAtPath("/World/Target").RemoveAppliedSchema("SpinTargetAPI")
        stage.GetPrimAtPath(TUBE).AddAppliedSchema("SpinTargetAPI")

    def bent_box(stage) -> None:
        box = UsdGeom.Cube.Define(stage, "/World/Target/Arm/Box")
        binding = UsdSkel.BindingAPI.Apply(box.GetPrim())
        binding.CreateSkeletonRel().SetTargets([SKELETON])
        binding.CreateJointIndicesPrimvar(False, 1).Set([0] * 8)
        binding.CreateJointWeightsPrimvar(False, 1).Set([1.0] * 8)

    with pytest.raises(StageError, match=f"^{TUBE}: its joint influences do not fit its points"):
        meshes(arm(too_few))
    with pytest.raises(UnsupportedError, match=f"^{TUBE}: .* only a part of its SkelRoot /World/Target/Arm"):
        meshes(arm(part, name="part.usda"))
    with pytest.raises(StageError, match=r"Arm/Box: has no points that a skeleton could deform"):
        meshes(arm(bent_box, name="bent.usda"))
