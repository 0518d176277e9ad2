"""Checks of a stage: none on what was just authored, and each rule finds what breaks it."""

import os
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdValidation

from spin_usd.basics.resources import bundled
from spin_usd.errors import InputError, SpinError, StageError
from spin_usd.geometry.camera import Camera
from spin_usd.scene.asset import MeshAsset, MeshPart
from spin_usd.scene.poses import PoseList
from spin_usd.stage.author.camera_layer import camera_layer_of, open_camera_layer
from spin_usd.stage.author.from_mesh_file import write_mesh_target
from spin_usd.stage.author.from_usd import copy_usd_target
from spin_usd.stage.author.target_asset import describe
from spin_usd.stage.author.target_root import Origin
from spin_usd.stage.author.write_stage import StageSources, write_stage
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

SECONDS_TO_REFUSE = 5.0  # USD hangs for ever
ORIGIN = Origin(inputs={"poses": ("poses.json", "0" * 64)})
OUTPUTS = {"image": "color3f", "depth": "float"}
POSES = PoseList(
    names=("a", "b", "c"),
    q_cam_body=np.array([[1.0, 0, 0, 0], [0.6, 0.8, 0, 0], [0, 0, 1, 0]]),
    t_cam_body=np.array([[0, 0, 5.0], [0, 0.1, 6], [0, 0, 7]]),
)
TETRAHEDRON = MeshPart(
    name="Bus",
    points=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
    face_counts=np.array([3, 3, 3, 3], np.int32),
    face_indices=np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], np.int32),
    normals=None,
    face_material=np.full(4, -1, np.int32),
)


def author(folder: Path) -> Path:
    file = write_mesh_target(MeshAsset(name="box", parts=(TETRAHEDRON,)), folder / "targets" / "box", "box")
    camera = open_camera_layer(bundled("camera", "speedplus"))
    sources = StageSources(camera=camera, origin=ORIGIN, seed=7)
    return write_stage(folder, sources, poses=POSES, target=describe(file, "box"), outputs=OUTPUTS)


@pytest.fixture(scope="module")
def authored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return author(tmp_path_factory.mktemp("stage"))


@pytest.fixture
def copied(authored: Path, tmp_path: Path) -> Path:
    """A copy of the authored stage to break; its root layer."""
    shutil.copytree(authored.parent, tmp_path / "copy")
    return tmp_path / "copy" / authored.name


def codes(path: Path) -> set[str]:
    return {finding.code for finding in check_stage(path)}


def test_a_stage_just_authored_has_no_findings(authored: Path) -> None:
    assert check_stage(authored) == ()


def test_every_layer_of_it_can_be_checked_as_a_root(authored: Path) -> None:
    """Only what makes a dataset fails there: a camera layer has no pictures and no target."""
    for path in sorted((authored.parent).rglob("*.usd*")):
        assert codes(path) <= {"scene"}, path


def test_the_built_in_target_has_no_findings(tmp_path: Path) -> None:
    asset = copy_usd_target(bundled("target", "tango"), tmp_path / "targets" / "tango", "tango", None)
    camera = camera_layer_of(
        Camera(width=64, height=40, fx=100.0, fy=99.0, cx=31.0, cy=21.0), pixel_pitch=1e-5, documentation=""
    )
    root = write_stage(
        tmp_path, StageSources(camera=camera, origin=ORIGIN, seed=0), poses=POSES, target=asset, outputs=OUTPUTS
    )
    assert check_stage(root) == ()
    stage = Usd.Stage.Open(str(root))
    keypoints = stage.GetPrimAtPath("/World/Target").GetRelationship("spin:target:keypoints").GetTargets()
    assert stage.GetPrimAtPath(keypoints[0]).IsA(UsdGeom.Points)


def edit(relative: str, change: Callable[[Usd.Stage], object]) -> Callable[[Path], None]:
    """Apply `change` to the layer at `relative` of the stage's folder."""

    def apply(root: Path) -> None:
        stage = Usd.Stage.Open(str(root.parent / relative))
        change(stage)
        stage.Save()

    return apply


def attribute(path: str, value: object, time: Usd.TimeCode | float | None = None) -> Callable[[Usd.Stage], object]:
    return lambda stage: stage.GetAttributeAtPath(path).Set(value, Usd.TimeCode.Default() if time is None else time)


def without(path: str, name: str) -> Callable[[Usd.Stage], object]:
    return lambda stage: stage.GetPrimAtPath(path).RemoveProperty(name)


def text(relative: str, old: str, new: str) -> Callable[[Path], None]:
    def apply(root: Path) -> None:
        file = root.parent / relative
        before = file.read_text()
        assert old in before
        file.write_text(before.replace(old, new, 1))

    return apply


def half_orient(stage: Usd.Stage) -> None:
    spec = stage.GetRootLayer().GetAttributeAtPath("/World/Target.xformOp:orient")
    spec.owner.RemoveProperty(spec)
    prim = stage.GetPrimAtPath("/World/Target")
    prim.CreateAttribute("xformOp:orient", Sdf.ValueTypeNames.Quath, custom=False).Set(Gf.Quath(1), 0.0)


def matrices(stage: Usd.Stage) -> None:
    prim = stage.GetPrimAtPath("/World/Target")
    op = prim.CreateAttribute("xformOp:transform", Sdf.ValueTypeNames.Matrix4d, custom=False)
    for at in range(3):
        op.Set(Gf.Matrix4d(1), float(at))
    prim.GetAttribute("xformOpOrder").Set(["xformOp:transform"])


def dead_variant(stage: Usd.Stage) -> None:
    """A variant on /World that changes what the same layer stack authors locally."""
    prim = stage.GetPrimAtPath("/World")
    variants = prim.GetVariantSets().AddVariantSet("pose")
    variants.AddVariant("near")
    variants.SetVariantSelection("near")
    with variants.GetVariantEditContext():
        stage.GetPrimAtPath("/World/Target").GetAttribute("xformOp:translate").Set(Gf.Vec3d(0, 1, 0))


def two_sets(stage: Usd.Stage) -> None:
    prim = stage.GetPrimAtPath("/World")
    for name in ("dim", "dark"):
        variants = prim.GetVariantSets().AddVariantSet(name)
        variants.AddVariant("on")
        variants.SetVariantSelection("on")
        with variants.GetVariantEditContext():
            stage.OverridePrim("/World/Lights/Sun").GetAttribute("inputs:intensity").Set(1.0)


def scaled_units(stage: Usd.Stage) -> None:
    stage.GetRootLayer().pseudoRoot.SetInfo("metersPerUnit", 0.01)


def no_picture(stage: Usd.Stage) -> None:
    """Neither names nor a range of time codes; the root layer's own range is in dataset.usda."""
    without("/World", "spin:capture:frame")(stage)
    root = Sdf.Layer.FindOrOpen(str(Path(stage.GetRootLayer().realPath).parents[1] / ROOT))
    root.endTimeCode = -1
    root.Save()


def shutter_backwards(stage: Usd.Stage) -> None:
    UsdGeom.Camera(stage.GetPrimAtPath("/Camera")).CreateShutterCloseAttr(-1.0)


def fill_of_no_unit(stage: Usd.Stage) -> None:
    fill = UsdLux.DistantLight.Define(stage, "/Lights/Fill")
    fill.CreateIntensityAttr(10.0)
    fill.CreateNormalizeAttr(True)


def fill_in_lux(stage: Usd.Stage) -> None:
    fill_of_no_unit(stage)
    stage.GetPrimAtPath("/Lights/Fill").SetCustomDataByKey("spin:intensityUnit", "lx")


def misspelt(stage: Usd.Stage) -> None:
    """Author spin:sensor:gian on the camera."""
    camera = next(prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera))
    camera.CreateAttribute("spin:sensor:gian", Sdf.ValueTypeNames.Double, custom=False).Set(4.0)


def tele(
    name: str, values: dict[str, object], change: Callable[[Usd.Stage], None] = lambda stage: None
) -> Callable[[Usd.Stage], None]:
    """Define an augmentation, not selected, that gives the camera other `values`, and `change`s the stage."""

    def define(stage: Usd.Stage) -> None:
        variants = stage.GetPrimAtPath("/World").GetVariantSets().AddVariantSet("augmentation")
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            for attribute, value in values.items():
                stage.OverridePrim("/World/Camera").GetAttribute(attribute).Set(value)
            change(stage)
        variants.ClearVariantSelection()

    return define


CAMERA, ROOT, LIGHTS, POSE = "layers/camera.usda", "dataset.usda", "layers/lights.usda", "layers/poses.usdc"
GEOMETRY = "targets/box/geometry.usdc"
BREAKS = {
    "missing reference": (text(ROOT, "./layers/lights.usda", "./layers/none.usda"), "usdValidation:Composition"),
    "absolute path": (text(ROOT, "./layers/lights.usda", "/layers/lights.usda"), "refused"),
    "search path": (text(ROOT, "./layers/lights.usda", "layers/lights.usda"), "path-not-anchored"),
    "path out of the folder": (text(ROOT, "./layers/lights.usda", "../lights.usda"), "refused"),
    "no up axis": (text(LIGHTS, '    upAxis = "Z"\n', ""), "layer-metadata"),
    "no end": (text(ROOT, "    endTimeCode = 2\n", ""), "layer-metadata"),
    "other clock": (edit(POSE, lambda stage: stage.SetTimeCodesPerSecond(1)), "layer-time"),
    "other units": (edit(GEOMETRY, scaled_units), "layer-units"),
    "no picture": (edit(POSE, no_picture), "scene"),
    "variant name": (edit(ROOT, tele("Tele", {})), "scene"),
    "variant's lens": (edit(ROOT, tele("tele", {"spin:lens:fx": 9000.0})), "lens-derived"),
    "variant that folds": (edit(ROOT, tele("tele", {"spin:lens:k1": -9.0})), "scene"),
    "bad name": (edit(POSE, attribute("/World.spin:capture:frame", "..", 1.0)), "scene"),
    "range": (text(ROOT, "endTimeCode = 2", "endTimeCode = 9"), "capture-range"),
    "two targets": (text(ROOT, '["SpinCaptureAPI"', '["SpinTargetAPI", "SpinCaptureAPI"'), "scene"),
    "nan": (edit(POSE, attribute("/World/Target.xformOp:translate", Gf.Vec3d(np.nan), 1.0)), "scene"),
    "quaternion": (edit(POSE, attribute("/World/Target.xformOp:orient", Gf.Quatd(2), 1.0)), "scene"),
    "half precision": (edit(POSE, half_orient), "pose-precision"),
    "matrices": (edit(POSE, matrices), "pose-matrix"),
    "aperture": (edit(CAMERA, attribute("/Camera.horizontalAperture", 0.2)), "lens-derived"),
    "interchange": (edit(CAMERA, attribute("/Camera.omni:lensdistortion:opencvPinhole:k1", 0.0)), "lens-derived"),
    "focal length": (edit(CAMERA, attribute("/Camera.spin:lens:fx", -1.0)), "scene"),
    "fold": (edit(CAMERA, attribute("/Camera.spin:lens:k1", -9.0)), "scene"),
    "no lens": (text(CAMERA, '"SpinLensAPI", ', ""), "lens-none"),
    "no camera": (text(ROOT, "./layers/camera.usda", "./layers/environment.usda"), "scene"),
    "resolution": (text("layers/render.usda", "(1920, 1200)", "(640, 480)"), "scene"),
    "kind": (text(ROOT, 'kind = "assembly"', 'kind = "subcomponent"'), "kind-broken"),
    "no class": (text("targets/box/box.usda", 'token[] semantics:labels:class = ["spacecraft"]', ""), "label-none"),
    "light": (text(LIGHTS, "bool inputs:normalize = 1", ""), "light"),
    "light in lux": (edit(LIGHTS, fill_in_lux), "light-unit"),
    "light of no unit": (edit(LIGHTS, fill_of_no_unit), "light-unit"),
    "unread turn": (text(LIGHTS, "float3 xf", "float3 xformOp:rotateXYZ:mine = (9, 9, 9)\nfloat3 xf"), "xform-unread"),
    "shutter": (edit(CAMERA, shutter_backwards), "scene"),
    "misspelt": (edit(CAMERA, misspelt), "property-unknown"),
    "misspelt in a variant": (edit(ROOT, tele("tele", {}, misspelt)), "property-unknown"),
    "extent": (edit(GEOMETRY, without("/Box/Bus", "extent")), "extent-none"),
    "dead variant": (edit(ROOT, dead_variant), "variant-dead"),
    "fighting variants": (edit(ROOT, two_sets), "variant-overlap"),
}  # fmt: skip


@pytest.mark.parametrize("name", BREAKS)
def test_each_rule_finds_what_breaks_it(copied: Path, name: str) -> None:
    break_it, code = BREAKS[name]
    break_it(copied)
    found = check_stage(copied)
    assert any(finding.code.startswith(code) for finding in found), found
    for finding in found:
        if not finding.code.startswith("usd"):  # USD's own say what is wrong and no more
            assert re.search("[;:?]", finding.message.partition(" (picture")[0]), finding


def findings(path: Path) -> list[tuple[str, str]]:
    return [(finding.code, finding.severity) for finding in check_stage(path)]


def test_lights_that_are_all_in_lux_are_of_one_unit(copied: Path) -> None:
    text(LIGHTS, 'intensityUnit = "W/m2"', 'intensityUnit = "lx"')(copied)
    assert "light-unit" not in dict(findings(copied))


def test_lights_none_of_which_says_its_unit_are_fine(copied: Path) -> None:
    """Such are the stages of other programs, and those of versions that did not say it."""
    edit(LIGHTS, fill_of_no_unit)(copied)
    edit(LIGHTS, lambda stage: stage.GetPrimAtPath("/Lights/Sun").ClearCustomData())(copied)
    assert findings(copied) == []


def test_pictures_named_by_their_time_codes_are_fine(copied: Path) -> None:
    edit(POSE, without("/World", "spin:capture:frame"))(copied)
    assert findings(copied) == []


def test_a_lens_that_other_programs_cannot_read_is_one_warning(copied: Path) -> None:
    camera = copied.parent / CAMERA
    lines = camera.read_text().splitlines(keepends=True)
    camera.write_text("".join(line for line in lines if "omni:lensdistortion" not in line))
    assert findings(copied) == [("lens-derived", "warning")]


def test_a_camera_without_a_lens_needs_a_resolution(copied: Path) -> None:
    text(CAMERA, '"SpinLensAPI", ', "")(copied)
    text(CAMERA, "omni:lensdistortion:model", "omni:lensdistortion:was")(copied)
    text(CAMERA, "Omni", "Other")(copied)
    assert [found for found in findings(copied) if found[0].startswith("lens")] == [("lens-none", "warning")]
    text("layers/render.usda", "uniform int2 resolution = (1920, 1200)", "")(copied)
    reader = StageReader(copied)
    with pytest.raises(StageError, match="has no size in pixels"):
        reader.scene(reader.frames[0])
    assert ("scene", "error") in findings(copied)


def test_a_variant_that_comes_before_a_reference_is_alive(copied: Path) -> None:
    """What arrives by reference can be changed by a variant on /World: no finding."""

    def dim(stage: Usd.Stage) -> None:
        variants = stage.GetPrimAtPath("/World").GetVariantSets().AddVariantSet("dim")
        for name, power in (("none", None), ("half", 680.5)):
            variants.AddVariant(name)
            variants.SetVariantSelection(name)
            if power:
                with variants.GetVariantEditContext():
                    stage.OverridePrim("/World/Lights/Sun").GetAttribute("inputs:intensity").Set(power)

    edit(ROOT, dim)(copied)
    assert check_stage(copied) == ()
    stage = Usd.Stage.Open(str(copied))
    assert stage.GetAttributeAtPath("/World/Lights/Sun.inputs:intensity").Get() == 680.5


def test_usds_validators_run(copied: Path) -> None:
    """A material binding without its API is USD's own rule, not one of ours."""
    text("targets/box/look.usda", 'prepend apiSchemas = ["MaterialBindingAPI"]', "")(copied)
    assert any("MaterialBindingApiApplied" in code for code in codes(copied))
    names = {v.GetMetadata().name for v in UsdValidation.ValidationRegistry().GetOrLoadAllValidators()}
    assert "usdShadeValidators:MaterialBindingApiAppliedValidator" in names


def test_what_is_no_stage_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not there"):
        check_stage(tmp_path / "none.usda")
    os.mkfifo(tmp_path / "pipe.usda")
    with pytest.raises(InputError, match="not a file"):
        check_stage(tmp_path / "pipe.usda")


@pytest.mark.parametrize(
    ("text", "saying"),
    [
        ("def {", "USD cannot read it"),
        ("[" * 200_000 + "]" * 200_000, "nests brackets deeper than"),
        ('def "A" (\nprepend references = @./pipe.usda@\n)\n{\n}\n', "is not a regular file"),
        ("(\ntimeCodesPerSecond = 0\n)\n", "timeCodesPerSecond is 0"),
    ],
)
def test_what_would_crash_or_hang_usd_is_one_finding(tmp_path: Path, text: str, saying: str) -> None:
    os.mkfifo(tmp_path / "pipe.usda")
    (tmp_path / "bad.usda").write_text(f"#usda 1.0\n{text}")
    started = time.perf_counter()
    (finding,) = check_stage(tmp_path / "bad.usda")
    assert time.perf_counter() - started < SECONDS_TO_REFUSE
    assert (finding.code, finding.severity) == ("refused", "error")
    assert saying in finding.message


def test_a_misspelt_property_is_told_with_the_one_that_was_meant(copied: Path) -> None:
    edit(CAMERA, misspelt)(copied)
    (finding,) = check_stage(copied)
    assert (finding.code, finding.where, finding.severity) == ("property-unknown", "/World/Camera", "warning")
    assert "spin:sensor:gian" in finding.message
    assert "is spin:sensor:gain meant?" in finding.message


@pytest.mark.parametrize(
    ("light", "severities"),
    [
        ('DomeLight "Sky"', []),
        ('SphereLight "Lamp"', ["warning"]),
        ('RectLight "Lamp"', ["warning"]),
        ('DistantLight "Sun"', ["error"]),
    ],
)
def test_a_plain_light_is_judged_by_its_fallbacks(
    make_stage: Callable[..., Path], light: str, severities: list[str]
) -> None:
    found = check_stage(make_stage(world=f"def {light} {{}}"))
    assert [finding.severity for finding in found if finding.code == "light"] == severities


def read_first(path: Path) -> None:
    reader = StageReader(path)
    reader.scene(reader.frames[0])


BAD_PICTURES = {
    "light": 'def SphereLight "Lamp" {\n float inputs:intensity = nan\n bool inputs:normalize = 1\n}',
    "light that is not drawn": 'def PortalLight "Lamp" {}',
    "geometry outside": 'def TetMesh "Moon" {}',
    "planet": 'def Xform "Earth" (prepend apiSchemas = ["SpinPlanetAPI"]) {\n double3 spin:planet:radii = (0, 0, 0)\n}',
    "stars": 'def Xform "Sky" (prepend apiSchemas = ["SpinStarsAPI"]) {\n double spin:stars:limitingMagnitude = nan\n}',
    "image": 'def DomeLight "Sky" {\n asset inputs:texture:file = @./gone.png@\n}',
}


@pytest.mark.parametrize("name", BAD_PICTURES)
def test_what_a_render_refuses_is_found(make_stage: Callable[..., Path], name: str) -> None:
    """The reader itself is the authority: the same words at the same place."""
    path = make_stage(world=BAD_PICTURES[name].replace(" {}", "\n{\n}").replace(" {\n", "\n{\n"))
    with pytest.raises(SpinError) as refusal:
        read_first(path)
    found = [finding for finding in check_stage(path) if finding.code == "scene"]
    assert [(finding.where, finding.severity) for finding in found] == [(str(refusal.value.where), "error")]
    assert refusal.value.found in found[0].message
    assert "variant nominal" in found[0].message


def test_what_is_wrong_in_a_later_picture_is_found_once_by_its_name(copied: Path) -> None:
    edit(POSE, attribute("/World/Target.xformOp:translate", Gf.Vec3d(0, 0, np.nan), 1.0))(copied)
    edit(ROOT, tele("other", {}))(copied)
    (finding,) = check_stage(copied)
    assert (finding.code, finding.where) == ("scene", "/World/Target")
    assert "(picture b of variant nominal)" in finding.message


def test_what_is_wrong_in_a_variant_alone_names_it(copied: Path) -> None:
    edit(ROOT, tele("tele", {"spin:lens:k1": -9.0}))(copied)
    (finding,) = [finding for finding in check_stage(copied) if finding.severity == "error"]
    assert (finding.code, finding.where) == ("scene", "/World/Camera")
    assert "(picture a of variant tele)" in finding.message


def test_progress_is_told_over_all_variants(copied: Path) -> None:
    edit(ROOT, tele("other", {}))(copied)
    told: list[tuple[int, int]] = []
    check_stage(copied, progress=lambda _, done, total: told.append((done, total)))
    assert told == [(0, 6), (3, 6), (3, 6), (6, 6)]


TURNING = """
double3 xformOp:translate.timeSamples = {{ 0: (0, 0, -10), 1: ({way}, 0, -10) }}
quatd xformOp:orient.timeSamples = {{ 0: (1, 0, 0, 0), 1: ({cosine}, {sine}, 0, 0) }}
uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]
"""
CUBE_M = 2 * np.sqrt(3)  # from corner to corner of USD's fallback cube


@pytest.mark.parametrize(
    ("degrees", "way", "close", "blended"),
    [(29, 0, 0.5, 0), (31, 0, 0.5, 1), (31, 0, 0, 0), (0, 0.99 * CUBE_M, 0.5, 0), (0, 1.01 * CUBE_M, 0.5, 1)],
)
def test_an_exposure_that_blends_unrelated_poses_is_told(
    make_stage: Callable[..., Path], degrees: float, way: float, close: float, blended: int
) -> None:
    """Of the two pictures the second has the shutter open after the last sample, where the target rests."""
    half = np.radians(degrees) / 2
    path = make_stage(
        camera=f"double shutter:open = 0\ndouble shutter:close = {close}",
        metadata="metersPerUnit = 1\nstartTimeCode = 0\nendTimeCode = 1",
        pose=TURNING.format(way=way, cosine=repr(float(np.cos(half))), sine=repr(float(np.sin(half)))),
    )
    found = [finding for finding in check_stage(path) if finding.code == "pose-blended"]
    assert [(finding.where, finding.severity) for finding in found] == [("/World/Target", "warning")] * blended
    assert all("exposures of 1 pictures" in finding.message for finding in found)


def test_samples_between_the_pictures_show_the_motion(make_stage: Callable[..., Path]) -> None:
    """40 degrees from picture to picture, but 20 from sample to sample."""
    turn = {at: np.radians(10 * at) / 2 for at in (0, 2, 4, 6, 8)}
    samples = ", ".join(f"{at}: ({float(np.cos(a))!r}, 0, {float(np.sin(a))!r}, 0)" for at, a in turn.items())
    path = make_stage(
        camera="double shutter:open = -1\ndouble shutter:close = 1",
        world="",
        pose=f"""double3 xformOp:translate = (0, 0, -10)
        quatd xformOp:orient.timeSamples = {{ {samples} }}
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]""",
    )
    capture = 'def Xform "World" (prepend apiSchemas = ["SpinCaptureAPI"])\n{\n'
    names = 'token spin:capture:frame.timeSamples = { 0: "a", 4: "b", 8: "c" }'
    path.write_text(path.read_text().replace('def Xform "World"\n{', capture + names, 1))
    assert not [finding for finding in check_stage(path) if finding.code in ("pose-blended", "scene")]


def test_all_of_a_stages_errors_are_reported_at_once(copied: Path) -> None:
    """One for each reader: of the camera, the target, its gprims, what lies outside, the lights."""

    def spoil(stage: Usd.Stage) -> None:
        UsdGeom.Cube.Define(stage, "/World/Stray").CreateSizeAttr(-1)
        UsdGeom.TetMesh.Define(stage, "/World/Wire")
        UsdGeom.Sphere.Define(stage, "/World/Target/Ball").CreateRadiusAttr(-1)
        UsdGeom.Cone.Define(stage, "/World/Target/Cone").CreateHeightAttr(-1)
        lamp = UsdLux.RectLight.Define(stage, "/World/Lamp")
        lamp.CreateWidthAttr(-1)
        UsdLux.PortalLight.Define(stage, "/World/Portal")
        stage.OverridePrim("/World/Camera").GetAttribute("projection").Set("orthographic")

    edit(ROOT, spoil)(copied)
    wrong = {finding.where for finding in check_stage(copied) if finding.code == "scene"}
    assert wrong == {
        "/World/Stray", "/World/Wire", "/World/Target/Ball", "/World/Target/Cone", "/World/Lamp.inputs:width",
        "/World/Portal", "/World/Camera",
    }  # fmt: skip


def test_what_is_wrong_with_geometry_is_told_where_no_target_is_named_yet(tmp_path: Path) -> None:
    cube = 'def Cube "Body" {\n double size = -1\n}\n'
    (tmp_path / "by_hand.usda").write_text(f'#usda 1.0\ndef Camera "Camera" {{\n}}\n{cube}')
    found = [
        (f.where.rpartition("/")[2], f.message) for f in check_stage(tmp_path / "by_hand.usda") if f.code == "scene"
    ]
    assert [where for where, _ in found] == ["by_hand.usda", "Camera", "Body"]
    assert "apply SpinTargetAPI" in found[0][1]


@pytest.mark.parametrize(
    ("intensity", "angle", "normalize", "look"),
    [
        (1000, 0.53, None, "nearly black"),
        (1361, 0.53, False, "nearly black"),
        (1361, 0, None, "as bright as"),
        (None, 0.53, True, "white"),
    ],
)
def test_a_sun_that_does_not_say_its_power_is_told_with_what_it_gives(
    copied: Path, intensity: float | None, angle: float, normalize: bool | None, look: str
) -> None:
    """The irradiance is that which pictures are rendered with."""

    def change(stage: Usd.Stage) -> None:
        light = UsdLux.DistantLight(stage.GetPrimAtPath("/Lights/Sun"))
        light.GetAngleAttr().Set(angle)
        light.GetIntensityAttr().Clear() if intensity is None else light.GetIntensityAttr().Set(intensity)
        light.GetNormalizeAttr().Clear() if normalize is None else light.GetNormalizeAttr().Set(normalize)

    edit(LIGHTS, change)(copied)
    (finding,) = [finding for finding in check_stage(copied) if finding.code == "light"]
    reader = StageReader(copied)
    (sun,) = reader.scene(reader.frames[0]).lights
    assert f"it gives {sun.irradiance[0]:.3g} W/m2 where the Sun gives 1361" in finding.message
    assert look in finding.message


@pytest.mark.parametrize(("intensity", "angle"), [(1361, 0), (2e7, 0.53)])
def test_a_sun_that_is_not_normalised_and_bright_enough_is_no_finding(
    copied: Path, intensity: float, angle: float
) -> None:
    def change(stage: Usd.Stage) -> None:
        light = UsdLux.DistantLight(stage.GetPrimAtPath("/Lights/Sun"))
        light.GetAngleAttr().Set(angle)
        light.GetIntensityAttr().Set(intensity)
        light.GetNormalizeAttr().Set(False)

    edit(LIGHTS, change)(copied)
    assert not [finding for finding in check_stage(copied) if finding.code == "light"]
