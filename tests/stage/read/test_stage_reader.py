"""StageReader: camera, pose, frames; what does not change is the same object."""

import time

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.stage.read.stage_reader import StageReader

ORDER = 'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]'
CAMERA_POSE = (7.0e6, -3.0e5, 120.0), (0.36, 0.48, -0.64, 0.48)
BODY_POSE = (7.0e6 + 3.25, -3.0e5 - 8.5, 121.125), (0.5, -0.5, 0.5, 0.5)
# Doubles of 7e6 m are 1e-9 m apart; poses are taken apart before they are turned, so no more than that is lost.
FAR_TOLERANCE = 2e-9
SECONDS_PER_FRAME = 5e-3  # measured 0.4 ms; ten times that on a loaded machine


def pose(place, turn) -> str:
    return f"double3 xformOp:translate = {place}\nquatd xformOp:orient = {turn}\n{ORDER}"


def scenes(path):
    reader = StageReader(path)
    return [reader.scene(frame) for frame in reader.frames]


def test_a_box_before_the_camera(read_scene) -> None:
    scene = read_scene()
    assert scene.frame.name == "frame_000000"
    assert (scene.camera.width, scene.camera.height, scene.camera.fx, scene.camera.cy) == (200, 120, 250, 60)
    np.testing.assert_allclose(scene.bodies[0].T_cam_body.translation, [0, 0, 10], atol=1e-15)
    np.testing.assert_allclose(scene.bodies[0].T_cam_body.rotation, np.diag([1, -1, -1]), atol=1e-15)
    assert len(scene.bodies[0].target.mesh.faces) == 12
    assert [(p.id, p.path, p.name, p.class_name) for p in scene.bodies[0].target.parts] == [
        (1, "/World/Target/Box", "Box", "unknown")
    ]


def test_the_pose_is_exact_far_from_the_stages_origin(read_scene) -> None:
    scene = read_scene(camera=pose(*CAMERA_POSE), pose=pose(*BODY_POSE))
    R_camera, R_body = matrix_from_quaternion(CAMERA_POSE[1]), matrix_from_quaternion(BODY_POSE[1])
    turn = np.diag([1.0, -1, -1])
    between = np.array([3.25, -8.5, 1.125])
    np.testing.assert_allclose(scene.bodies[0].T_cam_body.translation, turn @ R_camera.T @ between, atol=FAR_TOLERANCE)
    np.testing.assert_allclose(scene.bodies[0].T_cam_body.rotation, turn @ R_camera.T @ R_body, atol=1e-14)


@pytest.mark.parametrize("which", ["camera", "pose"])
@pytest.mark.parametrize(
    ("xform", "saying"),
    [
        ("float3 xformOp:scale = (1, 1, 2)", "shears or scales unequally"),
        ("float3 xformOp:scale = (-1, 1, 1)", "is mirrored"),
        ("float3 xformOp:scale = (0, 1, 1)", "is mirrored or flat"),
        ("double3 xformOp:translate = (nan, 0, 0)", "is not finite"),
        ("quatd xformOp:orient = (1, 1, 0, 0)", "norm is off 1 by 0.414"),
        ("quath xformOp:orient = (1, 0, 0, 0)", "half-precision"),
        ("matrix4d xformOp:transform = ((1, 0, 0, 0), (0.5, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))", "shears"),
    ],
)
def test_poses_that_are_none(read_scene, which, xform, saying) -> None:
    name = xform.split()[1]
    with pytest.raises(StageError, match=saying):
        read_scene(**{which: f'{xform}\nuniform token[] xformOpOrder = ["{name}"]'})


def test_a_bad_quaternion_in_any_sample_is_found_at_once(make_stage) -> None:
    samples = "quatd xformOp:orient.timeSamples = {\n0: (1, 0, 0, 0),\n1: (1, 0, 0, 0),\n2: (0.9, 0, 0, 0),\n}"
    path = make_stage(pose=f'{samples}\nuniform token[] xformOpOrder = ["xformOp:orient"]')
    with pytest.raises(
        StageError, match=r"^/World/Target.xformOp:orient: holds a quaternion whose norm is off 1 by 0.1"
    ):
        StageReader(path)


def test_an_equal_scale_of_the_camera_changes_nothing(read_scene) -> None:
    scaled = read_scene(camera='float3 xformOp:scale = (3, 3, 3)\nuniform token[] xformOpOrder = ["xformOp:scale"]')
    np.testing.assert_allclose(
        scaled.bodies[0].T_cam_body.matrix, read_scene(name="b.usda").bodies[0].T_cam_body.matrix, atol=1e-15
    )


RIG = 'def Xform "World"\n{{\n{}\nuniform token[] xformOpOrder = ["{}"]\n'


def rigged(path, op):
    """The stage with an operation on /World, above camera and target."""
    path.write_text(path.read_text().replace('def Xform "World"\n{\n', RIG.format(op, op.split()[1])))
    reader = StageReader(path)
    return reader.scene(reader.frames[0])


def test_what_holds_camera_and_target_scales_both(make_stage) -> None:
    scene = rigged(make_stage(), "float3 xformOp:scale = (3, 3, 3)")
    np.testing.assert_allclose(scene.bodies[0].T_cam_body.translation, [0, 0, 30], atol=1e-14)
    assert np.ptp(scene.bodies[0].target.mesh.points) == pytest.approx(6)


def test_a_camera_that_does_not_move_with_the_rest(make_stage) -> None:
    still = make_stage(camera='uniform token[] xformOpOrder = ["!resetXformStack!"]')
    scene = rigged(still, "double3 xformOp:translate = (0, 0, -5)")
    np.testing.assert_allclose(scene.bodies[0].T_cam_body.translation, [0, 0, 15], atol=1e-14)


def with_frames(path, names):
    """The stage with SpinCaptureAPI and these names at time codes 0, 1, ..."""
    stage = Usd.Stage.Open(str(path))
    prim = stage.GetDefaultPrim()
    prim.ApplyAPI("SpinCaptureAPI")
    for index, name in enumerate(names):
        prim.GetAttribute("spin:capture:frame").Set(name, index)
    prim.GetAttribute("spin:capture:seed").Set(42)
    stage.Save()
    return path


def test_frames_are_the_captures_samples(make_stage) -> None:
    reader = StageReader(with_frames(make_stage(), ["img7", "a.b-c_d"]))
    assert [(f.index, f.name, f.time_code) for f in reader.frames] == [(0, "img7", 0.0), (1, "a.b-c_d", 1.0)]
    assert reader.seed == 42
    assert StageReader(make_stage(name="plain.usda")).seed == 0


@pytest.mark.parametrize("name", ["../evil", "", ".hidden", "a/b", "a b", "x" * 201, "{camera}", "café", "a.tmp-b"])
def test_names_that_are_no_file_stem(make_stage, name) -> None:
    with pytest.raises(StageError, match="is not a valid name for a frame"):
        StageReader(with_frames(make_stage(), ["good", name]))


@pytest.mark.parametrize(("variant", "focal"), [("nominal", 250), ("tele", 900)])
def test_the_variant_is_the_one_asked_for_whatever_the_stage_selects(make_stage, variant, focal) -> None:
    path = make_stage()
    layer = Sdf.Layer.FindOrOpen(str(path))
    stage = Usd.Stage.Open(layer)
    augmentations = stage.GetPrimAtPath("/World").GetVariantSets().AddVariantSet("augmentation")
    augmentations.AddVariant("tele")
    augmentations.SetVariantSelection("tele")
    with augmentations.GetVariantEditContext():
        stage.GetPrimAtPath("/World/Camera").GetAttribute("spin:lens:fx").Set(900.0)
    lens = layer.GetPrimAtPath("/World/Camera")
    lens.RemoveProperty(lens.properties["spin:lens:fx"])
    base = Sdf.Layer.CreateNew(str(path.parent / "base.usda"))
    lower = Usd.Stage.Open(base)
    lower.OverridePrim("/Camera").CreateAttribute("spin:lens:fx", Sdf.ValueTypeNames.Double).Set(250.0)
    stage.GetPrimAtPath("/World/Camera").GetReferences().AddReference("./base.usda", "/Camera")
    base.Save()
    stage.Save()
    reader = StageReader(path, variant=variant)
    assert (reader.variant, reader.variants) == (variant, ("nominal", "tele"))
    assert reader.scene(reader.frames[0]).camera.fx == focal
    assert reader.variant_selections == ({} if variant == "nominal" else {"augmentation": "tele"})


def test_the_selections_of_every_prim_are_reported(make_stage) -> None:
    """By the set's name for the default prim, by path and set for what lies below it, instances too; none where nothing
    is selected."""
    path = make_stage()
    stage = Usd.Stage.Open(str(path))
    stage.DefinePrim("/Panel/Cell").GetVariantSets().AddVariantSet("age").AddVariant("new")
    stage.GetPrimAtPath("/Panel/Cell").GetVariantSet("age").SetVariantSelection("new")
    stage.DefinePrim("/World/Target/Panel").GetReferences().AddInternalReference("/Panel")
    stage.GetPrimAtPath("/World/Target/Panel").SetInstanceable(True)
    for prim, name, selected in (("/World", "light", True), ("/World/Target", "paint", True), ("/World", "off", False)):
        variants = stage.GetPrimAtPath(prim).GetVariantSets().AddVariantSet(name)
        variants.AddVariant("one")
        if selected:
            variants.SetVariantSelection("one")
    stage.Save()
    assert StageReader(path).variant_selections == {
        "light": "one",
        "/World/Target{paint}": "one",
        "/World/Target/Panel/Cell{age}": "new",
        "/Panel/Cell{age}": "new",
    }


def test_names_are_unique(make_stage) -> None:
    with pytest.raises(StageError, match="'same' names two frames"):
        StageReader(with_frames(make_stage(), ["same", "other", "same"]))
    with pytest.raises(StageError, match="'SAME' names two frames"):
        StageReader(with_frames(make_stage(name="capitals.usda"), ["same", "SAME"]))


RANGE = "metersPerUnit = 1\nstartTimeCode = 0\nendTimeCode = 3"


def test_a_static_target_is_one_object(make_stage) -> None:
    moving = "double3 xformOp:translate.timeSamples = {\n0: (0, 0, -10),\n3: (3, 0, -13),\n}"
    found = scenes(make_stage(metadata=RANGE, pose=f'{moving}\nuniform token[] xformOpOrder = ["xformOp:translate"]'))
    assert len(found) == 4
    assert all(scene.bodies[0].target is found[0].bodies[0].target for scene in found)
    assert [scene.bodies[0].T_cam_body.translation.tolist() for scene in found] == [[t, 0, 10 + t] for t in range(4)]


@pytest.mark.parametrize(
    "varying",
    [
        "double size.timeSamples = {\n0: 1,\n1: 2,\n2: 2,\n3: 1,\n}",
        "double xformOp:rotateX.timeSamples = {\n0: 0,\n1: 30,\n2: 30,\n3: 0,\n}\n"
        'uniform token[] xformOpOrder = ["xformOp:rotateX"]',
        "color3f[] primvars:displayColor.timeSamples = {\n"
        "0: [(1, 0, 0)],\n1: [(0, 1, 0)],\n2: [(0, 1, 0)],\n3: [(1, 0, 0)],\n}",
    ],
)
def test_a_target_that_changes_is_read_again_and_kept_while_equal(make_stage, varying) -> None:
    a, b, c, d = (s.bodies[0].target for s in scenes(make_stage(f'def Cube "Box"\n{{\n{varying}\n}}', metadata=RANGE)))
    assert a is not b
    assert b is c
    assert c is not d
    keys = [(t.mesh.key, [m.key for m in t.materials]) for t in (a, b, d)]
    assert keys[0] == keys[2] != keys[1]


PRESENCE = 'token inputs:opacityMode = "presence"\n'
PAINTED = """
def Sphere "Ball"
{{
    rel material:binding = </World/Target/Paint>
}}
def Cube "Box"
{{
    rel material:binding = </World/Target/Other>
}}
def Material "Paint"
{{
    token outputs:surface.connect = </World/Target/Paint/Shader.outputs:surface>
    def Shader "Shader"
    {{
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
        {varying}
    }}
}}
def Material "Other"
{{
    token outputs:surface.connect = </World/Target/Other/Shader.outputs:surface>
    def Shader "Shader"
    {{
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
        float inputs:roughness = 0.3
    }}
}}
"""


def painted(make_stage, varying):
    """The targets of the four frames where an input of the ball's material varies."""
    return [scene.bodies[0].target for scene in scenes(make_stage(PAINTED.format(varying=varying), metadata=RANGE))]


def test_a_material_that_changes_leaves_the_mesh_alone(make_stage) -> None:
    """So that renderers keep what they made of it."""
    found = painted(make_stage, "float inputs:roughness.timeSamples = {\n0: 0.2,\n1: 0.8,\n2: 0.8,\n3: 0.2\n}")
    roughness = [[material.roughness for material in each.materials] for each in found]
    np.testing.assert_allclose(roughness, [[0.2, 0.3], [0.8, 0.3], [0.8, 0.3], [0.2, 0.3]], rtol=1e-6)
    assert all(each.mesh is found[0].mesh for each in found)
    assert found[1] is found[2]
    assert found[0].key == found[3].key != found[1].key


@pytest.mark.parametrize(
    ("varying", "faces_differ"),
    [
        (
            PRESENCE + "float inputs:opacity.timeSamples = {\n0: 1,\n1: 0,\n2: 0,\n3: 1\n}",
            True,
        ),  # of the ball nothing is left
        (PRESENCE + "float inputs:opacity.timeSamples = {\n0: 0,\n1: 1,\n2: 1,\n3: 0\n}", True),
        ("float inputs:displacement.timeSamples = {\n0: 0,\n1: 0.5,\n2: 0.5,\n3: 0\n}", False),
    ],
)
def test_a_material_that_changes_the_shape_is_read_with_it(make_stage, varying, faces_differ) -> None:
    a, b, c, d = painted(make_stage, varying)
    assert (a.mesh.count != b.mesh.count) == faces_differ
    assert b is c
    assert a.mesh.key == d.mesh.key != b.mesh.key


def test_a_target_that_grows_by_its_own_scale(make_stage) -> None:
    growing = "float3 xformOp:scale.timeSamples = {\n0: (1, 1, 1),\n3: (4, 4, 4),\n}"
    found = scenes(make_stage(metadata=RANGE, pose=f'{growing}\nuniform token[] xformOpOrder = ["xformOp:scale"]'))
    assert [float(np.ptp(s.bodies[0].target.mesh.points)) for s in found] == pytest.approx([2, 4, 6, 8])


def test_a_lens_that_zooms_is_read_at_each_frame(make_stage) -> None:
    path = make_stage(metadata=RANGE)
    zoom = "double spin:lens:fx.timeSamples = {\n0: 250,\n3: 280,\n}"
    path.write_text(path.read_text().replace("double spin:lens:fx = 250", zoom))
    assert [s.camera.fx for s in scenes(path)] == [250, 260, 270, 280]


def test_lights_move_with_what_holds_them(make_stage) -> None:
    world = """
    def Xform "Rig"
    {
        double xformOp:rotateX.timeSamples = {
            0: 0,
            3: 90,
        }
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
        def DistantLight "Sun" {}
    }"""
    angles = [
        np.arctan2(-s.lights[0].direction_cam[1], s.lights[0].direction_cam[2])
        for s in scenes(make_stage(metadata=RANGE, world=world))
    ]
    np.testing.assert_allclose(np.degrees(angles), [0, 30, 60, 90], atol=1e-9)


@pytest.mark.parametrize(
    ("world", "occluders"),
    [
        ('def Cube "Earth" {}', [1]),
        ('def Xform "Group"\n{\ndef Sphere "Earth" {}\n}', [1]),
        ('def Cube "Earth"\n{\ntoken visibility.timeSamples = {\n0: "invisible",\n2: "inherited",\n}\n}', [0, 0, 1, 1]),
        ('def Cube "Earth"\n{\ntoken visibility = "invisible"\n}', [0]),
        ('def Cube "Earth"\n{\ntoken purpose = "guide"\n}', [0]),
        ('class Cube "Earth" {}', [0]),
    ],
)
def test_geometry_outside_the_target_occludes_where_it_is_visible(make_stage, world, occluders) -> None:
    found = scenes(make_stage(world=world, metadata=RANGE if len(occluders) > 1 else "metersPerUnit = 1"))
    assert [[body.id for body in scene.bodies[1:]] for scene in found] == [[0] * count for count in occluders]


def test_geometry_outside_the_target_is_never_dropped_in_silence(make_stage) -> None:
    with pytest.raises(UnsupportedError, match=r"^/World/Hair: is a TetMesh"):
        scenes(make_stage(world='def TetMesh "Hair" {}'))


@pytest.mark.parametrize(
    ("metadata", "saying"),
    [("metersPerUnit = 0", "metersPerUnit is 0"), ("metersPerUnit = -1", "metersPerUnit is -1")],
)
def test_units_that_are_none(make_stage, metadata, saying) -> None:
    with pytest.raises(StageError, match=saying):
        StageReader(make_stage(metadata=metadata))


def test_thousands_of_frames_cost_little_each(make_stage) -> None:
    path = make_stage(pose="")
    stage = Usd.Stage.Open(str(path))
    target = UsdGeom.Xformable(stage.GetPrimAtPath("/World/Target"))
    translate, orient = target.AddTranslateOp(), target.AddOrientOp(UsdGeom.XformOp.PrecisionDouble)
    capture = stage.GetDefaultPrim().CreateAttribute("spin:capture:frame", Sdf.ValueTypeNames.String)
    for i in range(2000):
        translate.Set(Gf.Vec3d(0, 0, -10 - i / 100), i)
        orient.Set(Gf.Quatd(np.cos(i), np.sin(i), 0, 0), i)
        capture.Set(f"img{i:06d}", i)
    stage.GetRootLayer().Export(str(path.with_suffix(".usdc")))
    reader = StageReader(path.with_suffix(".usdc"))
    reader.scene(reader.frames[0])
    started = time.perf_counter()
    found = [reader.scene(frame) for frame in reader.frames]
    assert (time.perf_counter() - started) / len(found) < SECONDS_PER_FRAME
    assert found[-1].bodies[0].T_cam_body.translation[2] == pytest.approx(10 + 19.99)
    assert found[-1].bodies[0].target is found[0].bodies[0].target


MOVED = """#usda 1.0
over "Grows"
{
    over "Ball"
    {
        double radius.timeSamples = { 0: 1, 3: 4 }
    }
}
"""
DECLARED = """#usda 1.0
over "Grows"
{
    over "Ball"
    {
        double radius
    }
}
"""
BY_CLIPS = """
def "Grows" (
    clips = {
        dictionary default = {
            double2[] active = [(0, 0)]
            asset[] assetPaths = [@./moved.usda@]
            asset manifestAssetPath = @./declared.usda@
            string primPath = "/Grows"
            double2[] times = [(0, 0), (3, 3)]
        }
    }
)
{
    def Sphere "Ball" {}
}
"""


def test_a_value_that_only_clips_have_varies_as_usds_own_box_does(tmp_path, make_stage) -> None:
    (tmp_path / "moved.usda").write_text(MOVED)
    (tmp_path / "declared.usda").write_text(DECLARED)
    path = make_stage(BY_CLIPS, metadata=RANGE)
    stage = Usd.Stage.Open(str(path))
    for code, scene in enumerate(scenes(path)):
        cache = UsdGeom.BBoxCache(code, [UsdGeom.Tokens.default_])
        box = cache.ComputeUntransformedBound(stage.GetPrimAtPath("/World/Target")).ComputeAlignedRange()
        assert scene.bodies[0].target.mesh.points.max(axis=0) == pytest.approx(box.GetMax(), abs=0.01)
        assert box.GetMax()[0] == 1 + code
