"""Authoring end to end: every kind of input, the same bytes twice, all or nothing, and other programs read it."""

import json
import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from msgspec import to_builtins
from pxr import Usd, UsdGeom, UsdMedia, UsdRender, UsdUtils

from spin_usd.commands.author.in_child import author_stage
from spin_usd.commands.author.reports import AuthorReport
from spin_usd.errors import InputError, OutputError, SpinError, StageError
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.hidden_folder import hidden_folder

POSES = [
    {"filename": f"img{i:06d}.jpg", "q_vbs2tango_true": q, "r_Vo2To_vbs_true": [0.1, 0.2, 5.0 + i]}
    for i, q in enumerate([[1, 0, 0, 0], [0.6, 0.8, 0, 0], [0, 0, 1, 0], [0, 0, 0.6, 0.8]])
]
FLOAT32_METRES = 1e-7  # points of a metre-sized model
SWEEP = 'def Mesh "Body" {\n int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n'
POINTS = " point3f[] points = [(0, 0, 0), (100, 0, 0), (0, 50, 0)]\n"


@pytest.fixture
def inputs(tmp_path: Path) -> dict[str, Any]:
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    trimesh.creation.box((2, 3, 4)).export(tmp_path / "box.stl")
    return {
        "poses": tmp_path / "poses.json",
        "target": tmp_path / "box.stl",
        "camera": "speedplus",
        "units_per_metre": 10,
        "out": tmp_path / "stage",
    }


def tree(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def usd_target(
    tmp_path: Path, metadata: str = "metersPerUnit = 0.01", body: str = "", name: str = "craft.usda"
) -> Path:
    path = tmp_path / "models" / name
    path.parent.mkdir(exist_ok=True)
    text = f'#usda 1.0\n(\n defaultPrim = "Body"\n upAxis = "Y"\n {metadata}\n)\n{SWEEP}{POINTS}{body}}}\n'
    path.write_text(text)
    return path


def span(report: AuthorReport) -> list[float]:
    """Edges of the target's box in the stage, metres, in its own axes."""
    stage = Usd.Stage.Open(report.root)
    cache = UsdGeom.BBoxCache(0, [UsdGeom.Tokens.default_])
    box = cache.ComputeRelativeBound(stage.GetPrimAtPath("/World/Target/Model"), stage.GetPrimAtPath("/World/Target"))
    return list(box.ComputeAlignedRange().GetSize())


def test_a_mesh_becomes_a_stage_without_findings(inputs: dict[str, Any]) -> None:
    report = author_stage(**inputs)
    assert (report.frames, report.target, report.meshes) == (4, "box", 1)
    assert json.loads(json.dumps(to_builtins(report)))["root"] == str(inputs["out"] / "dataset.usda")
    assert check_stage(report.root) == ()
    assert span(report) == pytest.approx([0.2, 0.3, 0.4], abs=FLOAT32_METRES)
    names = set(tree(inputs["out"]))
    assert {"dataset.usda", "layers/poses.usdc", "layers/camera.usda", "layers/lights.usda"} <= names
    assert {"layers/environment.usda", "layers/render.usda", "targets/box/box.usda"} <= names


def test_the_same_inputs_give_the_same_bytes_anywhere(inputs: dict[str, Any], tmp_path: Path) -> None:
    author_stage(**inputs)
    author_stage(**inputs | {"out": tmp_path / "deeper" / "other"})
    assert tree(inputs["out"]) == tree(tmp_path / "deeper" / "other")
    assert str(tmp_path).encode() not in b"".join(tree(inputs["out"]).values())


def test_a_stage_composes_the_same_after_it_was_moved(inputs: dict[str, Any], tmp_path: Path) -> None:
    before = span(author_stage(**inputs))
    (tmp_path / "poses.json").unlink()
    shutil.move(inputs["out"], tmp_path / "moved")
    root = tmp_path / "moved" / "dataset.usda"
    assert not UsdUtils.ComputeAllDependencies(str(root))[2]
    assert check_stage(root) == ()
    assert before == span(AuthorReport(root=str(root), frames=4, target="", meshes=1, camera="", views=None, notes=()))


def test_who_made_it_from_what_is_told_twice(inputs: dict[str, Any]) -> None:
    stage = Usd.Stage.Open(author_stage(**inputs, seed=11).root)
    data = stage.GetRootLayer().customLayerData["spin"]["inputs"]
    assert {role: entry["name"] for role, entry in data.items()} == {
        "poses": "poses.json", "target": "box.stl", "camera": "speedplus.usda",
    }  # fmt: skip
    api = UsdMedia.AuthorshipAPI(stage.GetPrimAtPath("/World"), "author")
    pairs = dict(zip(*[iter(api.GetInputsAttr().Get())] * 2, strict=True))
    assert pairs["target box.stl"] == "sha256:" + data["target"]["sha256"]
    assert api.GetSoftwarePackageAttr().Get() == "spin_usd"
    assert stage.GetAttributeAtPath("/World.spin:capture:seed").Get() == 11


def test_render_settings_name_the_camera_and_a_product_for_each_label(inputs: dict[str, Any]) -> None:
    stage = Usd.Stage.Open(author_stage(**inputs).root)
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    assert settings.GetCameraRel().GetTargets() == ["/World/Camera"]
    assert tuple(settings.GetResolutionAttr().Get()) == (1920, 1200)
    products = settings.GetProductsRel().GetTargets()
    assert [path.name for path in products] == ["image", "depth", "segmentation", "dense_pose"]


def test_frames_choose_pictures(inputs: dict[str, Any]) -> None:
    report = author_stage(**inputs, frames="1::2")
    stage = Usd.Stage.Open(report.root)
    frame = stage.GetAttributeAtPath("/World.spin:capture:frame")
    assert [frame.Get(i) for i in range(2)] == ["img000001", "img000003"]
    assert (report.frames, stage.GetEndTimeCode()) == (2, 1)


def test_a_usd_target_is_copied_and_scaled_by_its_own_unit(inputs: dict[str, Any], tmp_path: Path) -> None:
    ops = ' double3 xformOp:translate = (0, 0, 7)\n uniform token[] xformOpOrder = ["xformOp:translate"]\n'
    target = usd_target(tmp_path, body=ops)
    report = author_stage(**inputs | {"target": target, "units_per_metre": None})
    shutil.rmtree(target.parent)
    assert span(report) == pytest.approx([1, 0.5, 0], abs=FLOAT32_METRES)
    stage = Usd.Stage.Open(report.root)
    matrix = UsdGeom.Xformable(stage.GetPrimAtPath("/World/Target/Model")).GetLocalTransformation()
    assert np.array(matrix)[3, :3] == pytest.approx([0, 0, 0.07])  # the asset's own offset, in its own unit
    assert stage.GetPrimAtPath("/World/Target/Model").IsA(UsdGeom.Mesh)
    assert stage.GetPrimAtPath("/World/Target/Model").IsModel()
    assert not [finding for finding in check_stage(report.root) if finding.code.startswith(("layer-units", "path"))]


def test_a_usd_targets_dependencies_come_along(inputs: dict[str, Any], tmp_path: Path) -> None:
    top = tmp_path / "models" / "top.usda"
    geometry = usd_target(tmp_path, name="geometry.usda")
    for folder in ("shared", "middle"):
        (top.parent / folder).mkdir()
    geometry.rename(top.parent / "shared" / "geometry.usda")
    head = '#usda 1.0\n(\n defaultPrim = "Top"\n metersPerUnit = 0.01\n upAxis = "Y"\n)\n'
    middle = top.parent / "middle" / "middle.usda"
    middle.write_text(head + 'def "Top" (\n prepend payload = @../shared/geometry.usda@\n)\n{\n}\n')
    top.write_text(head + 'def "Top" (\n prepend references = @./middle/middle.usda@\n)\n{\n}\n')
    (top.parent / "geometry.usda").write_text("#usda 1.0\n")  # not the one that is meant
    report = author_stage(**inputs | {"target": top, "units_per_metre": 100})
    shutil.rmtree(tmp_path / "models")
    assert span(report) == pytest.approx([1, 0.5, 0], abs=FLOAT32_METRES)
    assert not [finding for finding in check_stage(report.root) if finding.code.startswith("path")]


def test_built_in_target_and_camera_files(inputs: dict[str, Any], tmp_path: Path) -> None:
    camera = {"Nu": 64, "Nv": 48, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[90, 0, 32], [0, 91, 24], [0, 0, 1]]}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    first = author_stage(**inputs | {"target": "tango", "units_per_metre": None, "camera": tmp_path / "camera.json"})
    assert check_stage(first.root) == ()
    again = {"camera": inputs["out"] / "layers" / "camera.usda", "out": tmp_path / "second"}
    second = author_stage(**inputs | {"target": "tango", "units_per_metre": None} | again)
    assert check_stage(second.root) == ()
    assert (tmp_path / "second/layers/camera.usda").read_text() == (inputs["out"] / "layers/camera.usda").read_text()


@pytest.mark.parametrize(
    ("changed", "found"),
    [
        ({"units_per_metre": None}, "--units-per-metre"),
        ({"camera": "hubble"}, "speedplus"),
        ({"camera": "none.json"}, "none.json"),
        ({"camera": "none.usda"}, "none.usda"),
        ({"target": "hubble"}, "tango"),
        ({"target": "none.obj"}, "none.obj"),
        ({"target": "model.txt"}, "model file"),
        ({"poses": "none.json"}, "none.json"),
        ({"frames": "9:"}, "none of 4"),
        ({"seed": 2**63}, "64 bits"),
    ],
)
def test_bad_arguments_leave_nothing_behind(inputs: dict[str, Any], changed: dict[str, Any], found: str) -> None:
    before = set(inputs["out"].parent.iterdir())
    with pytest.raises(InputError, match=found):
        author_stage(**inputs | changed)
    assert set(inputs["out"].parent.iterdir()) == before


@pytest.mark.parametrize(
    ("metadata", "body", "units", "found"),
    [
        ("", "", None, "metersPerUnit"),
        ("metersPerUnit = 0.01", "", 1, "0.01, but 1 units"),
        ("metersPerUnit = 0", "", None, "above zero"),
        ("metersPerUnit = 1", ' def Xform "A" (\n references = @./none.usda@</B>\n) {}\n', None, "missing"),
        ("metersPerUnit = 1", ' def Xform "A" (\n references = </Body>\n) {}\n', None, "does not compose"),
    ],
)
def test_bad_usd_targets_are_refused(
    inputs: dict[str, Any], tmp_path: Path, metadata: str, body: str, units: float | None, found: str
) -> None:
    target = usd_target(tmp_path, metadata, body)
    with pytest.raises(InputError, match=found) as caught:
        author_stage(**inputs | {"target": target, "units_per_metre": units})
    assert "craft.usda" in str(caught.value)
    assert not inputs["out"].exists()


@pytest.mark.parametrize("packed", [False, True])
def test_a_usd_target_that_is_marked_as_one_is_one_target(inputs: dict[str, Any], tmp_path: Path, packed: bool) -> None:
    target = usd_target(tmp_path)
    mark = '(\n prepend apiSchemas = ["SpinTargetAPI"]\n)'
    target.write_text(target.read_text().replace('"Body" {', f'"Body" {mark}\n{{'))
    if packed:
        assert UsdUtils.CreateNewUsdzPackage(str(target), str(tmp_path / "craft.usdz"))
        target = tmp_path / "craft.usdz"
    report = author_stage(**inputs | {"target": target, "units_per_metre": None})
    reader = StageReader(report.root)
    target_read = reader.scene(reader.frames[0]).bodies[0].target
    assert [target_read.path, *(part.path for part in target_read.parts)] == ["/World/Target", "/World/Target/Model"]
    assert not [finding for finding in check_stage(report.root) if finding.code == "target-count"]


def test_a_usd_target_with_a_target_inside_is_refused(inputs: dict[str, Any], tmp_path: Path) -> None:
    inner = ' def Xform "Inner" (\n prepend apiSchemas = ["SpinTargetAPI"]\n) {\n}\n'
    with pytest.raises(InputError, match=r"craft\.usda: its prim /Body/Inner has SpinTargetAPI"):
        author_stage(**inputs | {"target": usd_target(tmp_path, body=inner), "units_per_metre": None})
    assert not inputs["out"].exists()


@pytest.mark.parametrize("data", [b"#usda 1.0\ndef {", b"PXR-USDC\0\x08", b"", b"\0" * 99])
def test_a_damaged_layer_below_a_usd_target_is_refused(inputs: dict[str, Any], tmp_path: Path, data: bytes) -> None:
    target = usd_target(tmp_path, body=' def "A" (\n references = @./part.usd@\n) {}\n')
    (target.parent / "part.usd").write_bytes(data)
    with pytest.raises(StageError, match=r"part\.usd"):
        author_stage(**inputs | {"target": target, "units_per_metre": None})
    target.write_bytes(data)
    with pytest.raises(StageError, match=r"craft\.usda"):
        author_stage(**inputs | {"target": target, "units_per_metre": None})
    assert not inputs["out"].exists()


def test_a_usd_target_that_refers_to_itself_is_refused(inputs: dict[str, Any], tmp_path: Path) -> None:
    target = usd_target(tmp_path, body=' def "A" (\n references = @./craft.usda@\n) {}\n')
    with pytest.raises(InputError, match=r"craft\.usda: does not compose"):
        author_stage(**inputs | {"target": target, "units_per_metre": None})


def test_a_full_disk_is_an_output_error_that_leaves_nothing(inputs: dict[str, Any]) -> None:
    """A limit on the size of a file stands for the disk: both fail the write call."""
    code = (
        "import resource, signal; from spin_usd.commands.author.in_child import author_stage;"
        "from spin_usd.errors import OutputError; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))\n"
        f"try: author_stage(poses={str(inputs['poses'])!r}, target='tango', camera='speedplus', "
        f"out={str(inputs['out'])!r})\n"
        "except OutputError as error: print('OUTPUT', error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.startswith(f"OUTPUT {inputs['out']}/"), done  # not the hidden folder
    assert done.stdout.count("\n") == 1
    assert {path.name for path in inputs["out"].parent.iterdir()} == {"poses.json", "box.stl"}


def test_a_target_without_geometry_is_refused(inputs: dict[str, Any], tmp_path: Path) -> None:
    target = usd_target(tmp_path)
    target.write_text('#usda 1.0\n(\n metersPerUnit = 1\n)\ndef Xform "A" {\n}\n')
    with pytest.raises(InputError, match="no geometry"):
        author_stage(**inputs | {"target": target, "units_per_metre": None})


def test_a_folder_that_holds_something_is_not_touched(inputs: dict[str, Any]) -> None:
    inputs["out"].mkdir()
    author_stage(**inputs)  # an empty folder is as good as none
    before = tree(inputs["out"])
    with pytest.raises(InputError, match="is not empty"):
        author_stage(**inputs | {"camera": "shirt"})
    assert tree(inputs["out"]) == before


def test_an_unwritable_place_is_an_output_error(inputs: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be made"):
        author_stage(**inputs | {"out": tmp_path / "file" / "stage"})


def test_what_a_killed_run_left_is_swept_by_the_next(inputs: dict[str, Any]) -> None:
    """Killed by itself amid the writing; what a live process writes stays, and what only looks like a killed one's."""
    code = (
        "import os, pathlib; from spin_usd.store.new_folder import new_folder\n"
        f"with new_folder(pathlib.Path({str(inputs['out'])!r})) as work:\n"
        "    (work / 'half').write_text('x'); os.kill(os.getpid(), 9)"
    )
    parent = inputs["out"].parent
    with hidden_folder(parent, "stage") as live:
        subprocess.run([sys.executable, "-c", code], check=False)
        (left,) = (path for path in parent.glob(".stage.*") if path != live.folder)
        token = left.name.split(".")[2]
        for name in (".stage.20251122.bak", f".stage.b.{token}", f".stage.{'0' * 32}", f".stage.{token}.bak"):
            shutil.copytree(left, parent / name)
        others = {path for path in parent.glob(".*") if path != left}
        author_stage(**inputs)
        assert set(parent.glob(".*")) == others
        assert {path.name for path in parent.glob(".stage.*/stage/*")} == {"half"}
    assert check_stage(inputs["out"] / "dataset.usda") == ()


def test_two_at_once_make_one_whole_stage(inputs: dict[str, Any]) -> None:
    errors: list[SpinError] = []

    def author() -> None:
        try:
            author_stage(**inputs)
        except SpinError as error:
            errors.append(error)

    threads = [threading.Thread(target=author) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(errors) == 1
    assert check_stage(inputs["out"] / "dataset.usda") == ()
    assert not [path for path in inputs["out"].parent.iterdir() if path.name.startswith(".")]


@pytest.mark.slow
def test_blenders_own_importer_reads_it(inputs: dict[str, Any]) -> None:
    """An authority that shares no code with us: meshes, and the camera's focal length and sensor in millimetres."""
    report = author_stage(**inputs)
    code = (
        "import bpy, json, os, sys; bpy.ops.wm.read_factory_settings(use_empty=True);"
        f"bpy.ops.wm.usd_import(filepath={report.root!r});"
        "c = [o.data for o in bpy.data.objects if o.type == 'CAMERA'][0];"
        "n = sum(o.type == 'MESH' for o in bpy.data.objects);"
        "print('RESULT', json.dumps([n, c.lens, c.sensor_width, c.sensor_height])); sys.stdout.flush(); os._exit(0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=dict(os.environ), check=False
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT")]
    assert lines, done.stderr
    meshes, lens, width, height = json.loads(lines[0].removeprefix("RESULT"))
    assert meshes == report.meshes
    assert [lens, width, height] == pytest.approx([17.513077, 11.2512, 7.032563], rel=1e-5)
