"""Every bad input: one sentence on standard error that says what and where, exit code 2, nothing half-written.

The functions that the commands' children call refuse all of it; the commands themselves, one input of each kind.
"""

import json
from typing import Any

import numpy as np
import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.commands.author.in_child import author_stage
from spin_usd.commands.render.run import render_dataset
from spin_usd.errors import SpinError
from spin_usd.options import RunOptions
from spin_usd.planning.in_child import open_plan, plan_pictures
from spin_usd.planning.plan_calls import OpenPlan, PlanPart
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort
from tests.cases.png import png
from tests.cases.requests import request_for

GOOD_POSE = {"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 5]}
GOOD_CAMERA = {
    "Nu": 64,
    "Nv": 40,
    "cameraMatrix": [[100, 0, 32], [0, 100, 20], [0, 0, 1]],
    "distCoeffs": [0, 0, 0, 0, 0],
}
GOOD_MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def pose(**changes):
    return json.dumps([{**GOOD_POSE, **changes}])


def camera(**changes):
    return json.dumps({**GOOD_CAMERA, **changes})


def matrix(fx, fy):
    return [[fx, 0, 32], [0, fy, 20], [0, 0, 1]]


# name: (file, its content, a word that the sentence must hold)
BAD_FILES = {
    "pose list with NaN": ("poses.json", pose(r_Vo2To_vbs_true=[0, 0, float("nan")]), "NaN"),
    "pose list with infinity": ("poses.json", pose(r_Vo2To_vbs_true=[0, 0, float("inf")]), "infin"),
    "zero quaternion": ("poses.json", pose(q_vbs2tango_true=[0, 0, 0, 0]), "quaternion"),
    "quaternion of norm 2": ("poses.json", pose(q_vbs2tango_true=[2, 0, 0, 0]), "norm"),
    "quaternion of three numbers": ("poses.json", pose(q_vbs2tango_true=[1, 0, 0]), "q_vbs2tango_true"),
    "position as text": ("poses.json", pose(r_Vo2To_vbs_true=["0", "0", "5"]), "r_Vo2To_vbs_true"),
    "pose without position": ("poses.json", json.dumps([{"filename": "a", "q_vbs2tango": [1, 0, 0, 0]}]), "r_Vo2To"),
    "pose without name": ("poses.json", json.dumps([{k: GOOD_POSE[k] for k in list(GOOD_POSE)[1:]}]), "filename"),
    "duplicate names": ("poses.json", json.dumps([GOOD_POSE, {**GOOD_POSE, "filename": "a.png"}]), "'a'"),
    "name that climbs": ("poses.json", pose(filename="../../.."), "name"),
    "name with a line break": ("poses.json", pose(filename="a\nb.jpg"), "name"),
    "empty list": ("poses.json", "[]", "no pose"),
    "empty file": ("poses.json", "", "JSON"),
    "truncated JSON": ("poses.json", pose()[:-20], "JSON"),
    "JSON that is no list": ("poses.json", "7", "list"),
    "zero focal length": ("camera.json", camera(cameraMatrix=matrix(0, 100)), "focal"),
    "negative focal length": ("camera.json", camera(cameraMatrix=matrix(100, -100)), "focal"),
    "camera with NaN": ("camera.json", camera(cameraMatrix=matrix(float("nan"), 100)), "NaN"),
    "absurd image size": ("camera.json", camera(Nu=10**7), "width"),
    "no image size": ("camera.json", camera(Nv=0), "height"),
    "four distortion coefficients of text": ("camera.json", camera(distCoeffs=["a"] * 5), "distCoeffs"),
    "lens that folds": ("camera.json", camera(distCoeffs=[-3, 0, 0, 0, 0]), "invert"),
    "camera that is no JSON": ("camera.json", "<xml/>", "JSON"),
    "face that indexes nothing": ("mesh.obj", GOOD_MESH + "f 1 2 99\n", "99"),
    "mesh with NaN": ("mesh.obj", GOOD_MESH.replace("v 1 0 0", "v nan 0 0"), "NaN"),
    "mesh without faces": ("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no face"),
    "mesh of zero-area faces": ("mesh.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "area"),
    "empty mesh file": ("mesh.obj", "", "no face"),
}


@pytest.fixture
def inputs(tmp_path):
    (tmp_path / "poses.json").write_text(pose())
    (tmp_path / "camera.json").write_text(camera())
    (tmp_path / "mesh.obj").write_text(GOOD_MESH)
    return tmp_path


def choices(inputs, **changes):
    files = {"poses": "poses.json", "camera": "camera.json", "target": "mesh.obj", "out": "stage"}
    return {name: inputs / file for name, file in files.items()} | {"units_per_metre": 1} | changes


def author(inputs, **changes):
    given = {name: value for name, value in choices(inputs, **changes).items() if value is not None}
    return ["author", *(text for name, value in given.items() for text in (f"--{name.replace('_', '-')}", value))]


def refused(spin_usd, arguments, word, *, code=2):
    """Run, and hold the refusal to its promise; returns the sentence."""
    done = spin_usd(*arguments, code=code)
    assert done.stdout == ""
    assert done.stderr.startswith("spin-usd: ")
    assert_one_sentence(done.stderr, word)
    return done.stderr


def assert_one_sentence(said, word) -> None:
    assert len(said.splitlines()) == 1
    assert word.lower() in said.lower(), said


def test_the_inputs_are_otherwise_good(inputs, spin_usd) -> None:
    spin_usd(*author(inputs))
    spin_usd("render", inputs / "stage" / "dataset.usda", "--out", inputs / "data", "--renderer", "raycast")


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_refused(inputs, name) -> None:
    file, content, word = BAD_FILES[name]
    (inputs / file).write_text(content)
    with pytest.raises(SpinError) as raised:
        author_stage(**choices(inputs))
    assert_one_sentence(str(raised.value), word)
    assert file in str(raised.value)
    assert {p.name for p in inputs.iterdir()} == {"poses.json", "camera.json", "mesh.obj"}


@pytest.mark.parametrize("name", ["truncated JSON", "lens that folds", "face that indexes nothing"])
def test_author_refuses_bad_files(inputs, spin_usd, name) -> None:
    file, content, word = BAD_FILES[name]
    (inputs / file).write_text(content)
    sentence = refused(spin_usd, author(inputs), word)
    assert file in sentence
    assert {p.name for p in inputs.iterdir()} == {"poses.json", "camera.json", "mesh.obj"}


BAD_OPTIONS: dict[str, tuple[dict[str, Any], str]] = {
    "no pose list": ({"poses": "nowhere.json"}, "nowhere.json"),
    "unknown camera": ({"camera": "hubble"}, "speedplus"),
    "unknown target": ({"target": "voyager"}, "tango"),
    "missing mesh": ({"target": "nowhere.obj"}, "nowhere.obj"),
    "units not given": ({"units_per_metre": None}, "--units-per-metre"),
    "zero units": ({"units_per_metre": 0}, "units"),
    "negative units": ({"units_per_metre": -1}, "units"),
    "units that are no number": ({"units_per_metre": "nan"}, "units"),
    "frames that select none": ({"frames": "7:9"}, "7:9"),
    "frames that are no slice": ({"frames": "a:b"}, "a:b"),
    "output in a file": ({"out": "mesh.obj/stage"}, "mesh.obj"),
    "output in a read-only place": ({"out": "/proc/spin_usd"}, "/proc"),
}


def bad_options(inputs, name):
    changes, word = BAD_OPTIONS[name]
    if str(changes.get("out", "")).startswith("mesh.obj"):
        changes = {"out": inputs / changes["out"]}
    return changes, word


@pytest.mark.parametrize("name", BAD_OPTIONS)
def test_bad_options_are_refused(inputs, name) -> None:
    changes, word = bad_options(inputs, name)
    with pytest.raises(SpinError) as raised:
        author_stage(**choices(inputs, **changes))
    assert_one_sentence(str(raised.value), word)
    assert {p.name for p in inputs.iterdir()} == {"poses.json", "camera.json", "mesh.obj"}


@pytest.mark.parametrize("name", ["units not given", "units that are no number", "output in a read-only place"])
def test_author_refuses_bad_options(inputs, spin_usd, name) -> None:
    changes, word = bad_options(inputs, name)
    refused(spin_usd, author(inputs, **changes), word)
    assert {p.name for p in inputs.iterdir()} == {"poses.json", "camera.json", "mesh.obj"}


def test_author_does_not_overwrite(inputs, spin_usd) -> None:
    (inputs / "stage").mkdir()
    (inputs / "stage" / "thesis.tex").write_text("precious")
    refused(spin_usd, author(inputs), "not empty")
    assert [p.name for p in (inputs / "stage").iterdir()] == ["thesis.tex"]


HEAD = '#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
CAMERA = """
    def Camera "Camera" (prepend apiSchemas = ["SpinLensAPI"])
    {
        int2 spin:lens:imageSize = (64, 40)
        double spin:lens:fx = 100
        double spin:lens:fy = 100
        double spin:lens:cx = 32
        double spin:lens:cy = 20
    }
"""
TARGET = """
    def Xform "Target" (prepend apiSchemas = ["SpinTargetAPI"])
    {
        double3 xformOp:translate = (0, 0, -5)
        quatd xformOp:orient = (1, 0, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]
        def Mesh "Body"
        {
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
            uniform token subdivisionScheme = "none"
        }
    }
"""


TEXTURED = """
        def Material "M"
        {
            token outputs:surface.connect = </World/Target/M/S.outputs:surface>
            def Shader "S"
            {
                uniform token info:id = "UsdPreviewSurface"
                token outputs:surface
                color3f inputs:diffuseColor.connect = </World/Target/M/T.outputs:rgb>
            }
            def Shader "T"
            {
                uniform token info:id = "UsdUVTexture"
                asset inputs:file = @./gone.png@
                float3 outputs:rgb
            }
        }
"""


def stage(*content, head=HEAD):
    return head + 'def Xform "World"\n{' + "".join(content) + "}\n"


# name: (the stage, a word that the sentence must hold)
BAD_STAGES = {
    "not USD": ("hello", "stage.usda"),
    "empty file": ("", "stage.usda"),
    "brackets that do not close": (
        stage(CAMERA, TARGET.replace("[3]", "[3}")),
        "cannot be understood, at '}'; fix the layer",
    ),
    "quotes that do not close": (
        HEAD + 'def Xform "World\n',
        "line 7, column 17: cannot be understood, at the end of the line;",
    ),
    "value of another type": (stage(CAMERA.replace("fx = 100", 'fx = "100"')), "line 12, column 31: Error parsing"),
    "no camera": (stage(TARGET), "camera"),
    "no target": (stage(CAMERA), "target"),
    "missing reference": (
        stage(CAMERA, TARGET.replace('SpinTargetAPI"]', 'SpinTargetAPI"]\nreferences = @./gone.usda@')),
        "gone.usda",
    ),
    "reference cycle": (
        stage(CAMERA, TARGET).replace('"World"\n{', '"World" (references = @./stage.usda@)\n{'),
        "cycle",
    ),
    "reference out of the folder": (
        stage(CAMERA, TARGET.replace('SpinTargetAPI"]', 'SpinTargetAPI"]\nreferences = @../../../../etc/hosts.usda@')),
        "hosts.usda",
    ),
    "absolute reference": (
        stage(CAMERA, TARGET.replace('SpinTargetAPI"]', 'SpinTargetAPI"]\nreferences = @/etc/passwd@')),
        "/etc/passwd",
    ),
    "index out of range": (stage(CAMERA, TARGET.replace("[0, 1, 2]", "[0, 1, 7]")), "/World/Target/Body"),
    "negative index": (stage(CAMERA, TARGET.replace("[0, 1, 2]", "[0, 1, -2]")), "/World/Target/Body"),
    "counts that do not sum": (stage(CAMERA, TARGET.replace("Counts = [3]", "Counts = [4]")), "/World/Target/Body"),
    "two-cornered face": (stage(CAMERA, TARGET.replace("Counts = [3]", "Counts = [2, 1]")), "/World/Target/Body"),
    "NaN point": (stage(CAMERA, TARGET.replace("(1, 0, 0), ", "(nan, 0, 0), ")), "/World/Target/Body"),
    "mesh without faces": (
        stage(CAMERA, TARGET.replace("[3]", "[]").replace("[0, 1, 2]", "[]")),
        "/World/Target",
    ),
    "zero-area faces alone": (stage(CAMERA, TARGET.replace("(0, 1, 0)]", "(2, 0, 0)]")), "/World/Target"),
    "zero quaternion": (stage(CAMERA, TARGET.replace("= (1, 0, 0, 0)", "= (0, 0, 0, 0)")), "quaternion"),
    "quaternion of norm 2": (stage(CAMERA, TARGET.replace("= (1, 0, 0, 0)", "= (2, 0, 0, 0)")), "norm"),
    "half-precision quaternion": (stage(CAMERA, TARGET.replace("quatd", "quath")), "half"),
    "op that is not there": (stage(CAMERA, TARGET.replace('orient"]', 'orient", "xformOp:scale"]')), "xformOp:scale"),
    "zero focal length in the stage": (stage(CAMERA.replace("fx = 100", "fx = 0"), TARGET), "focal"),
    "lens that folds in the stage": (
        stage(CAMERA.replace("cy = 20", "cy = 20\ndouble spin:lens:k1 = -3"), TARGET),
        "invert",
    ),
    "metersPerUnit 0": (stage(CAMERA, TARGET, head=HEAD.replace("Unit = 1", "Unit = 0")), "metersPerUnit"),
    "tetrahedra beside the target": (stage(CAMERA, TARGET, '    def TetMesh "Moon"\n    {\n    }\n'), "/World/Moon"),
    "a light that is not drawn": (stage(CAMERA, TARGET, '    def PortalLight "Lamp"\n    {\n    }\n'), "/World/Lamp"),
    "missing texture": (
        stage(
            CAMERA,
            TARGET.replace('def Mesh "Body"', 'def Mesh "Body" (prepend apiSchemas = ["MaterialBindingAPI"])')
            .replace("uniform token sub", "rel material:binding = </World/Target/M>\nuniform token sub")
            .replace("        def Mesh", TEXTURED + "        def Mesh"),
        ),
        "gone.png",
    ),
}


@pytest.mark.parametrize("name", BAD_STAGES)
def test_bad_stages_are_refused(tmp_path, name) -> None:
    content, word = BAD_STAGES[name]
    (tmp_path / "stage.usda").write_text(content)
    with pytest.raises(SpinError) as raised:
        planned(tmp_path / "stage.usda", tmp_path / "copy")
    assert_one_sentence(str(raised.value), word)


def test_labels_alone_decode_no_texture(tmp_path) -> None:
    """A texture damaged behind its header keeps an image from being made, and no label."""
    content, _ = BAD_STAGES["missing texture"]
    (tmp_path / "stage.usda").write_text(content)
    noise = np.random.default_rng(0).integers(0, 256, (32, 32, 3))
    (tmp_path / "gone.png").write_bytes(png(noise, color=2)[:1000])
    assert planned(tmp_path / "stage.usda", tmp_path / "labels", renders=False)
    with pytest.raises(SpinError, match=r"gone.png.* is cut short"):
        planned(tmp_path / "stage.usda", tmp_path / "images")


def planned(path, copy, renders=True):
    """What a child of `render` does first of all."""
    opened, _ = open_plan(OpenPlan(stage=str(path), renders=renders, copy_to=str(copy)))
    part = PlanPart(
        root=opened.root,
        variants=opened.variants,
        chosen=opened.chosen,
        settings=RenderSettings(renderer="raycast", effort=Effort(samples=1), seed=0),
        image_suffix=".png",
        labels=(),
        renders=renders,
    )
    return plan_pictures(part, no_progress)


def test_such_a_stage_is_otherwise_good(good_stage, tmp_path) -> None:
    assert planned(good_stage, tmp_path / "copy")


@pytest.mark.parametrize("name", ["not USD", "missing reference", "index out of range", "missing texture"])
def test_render_refuses_bad_stages(tmp_path, spin_usd, name) -> None:
    content, word = BAD_STAGES[name]
    (tmp_path / "stage.usda").write_text(content)
    refused(spin_usd, ["render", tmp_path / "stage.usda", "--out", tmp_path / "data", "--renderer", "raycast"], word)
    assert [p.name for p in tmp_path.iterdir()] == ["stage.usda"]


def test_a_stage_that_multiplies_without_end_is_refused(tmp_path) -> None:
    """2.3 kB of doubling references: 2**32 prims, of which USD would compose each."""
    doubling = "".join(
        f'def "D{i}"\n{{\n  def "A" (references = </D{i + 1}>)\n  {{\n  }}\n'
        f'  def "B" (references = </D{i + 1}>)\n  {{\n  }}\n}}\n'
        for i in range(30)
    )
    (tmp_path / "stage.usda").write_text(HEAD + doubling + 'def "D30"\n{\n}\n' + stage(CAMERA, TARGET, head=""))
    request = request_for(tmp_path / "stage.usda", effort=Effort())
    with pytest.raises(SpinError, match=r"stage\.usda: has more than 200000 prims"):
        render_dataset(request, tmp_path / "data", RunOptions(), progress=lambda *_: None)
    assert [p.name for p in tmp_path.iterdir()] == ["stage.usda"]


@pytest.fixture
def good_stage(tmp_path):
    (tmp_path / "stage.usda").write_text(stage(CAMERA, TARGET))
    return tmp_path / "stage.usda"


BAD_RENDERS = {
    "unknown variant": (["--variants", "noon"], "noon"),
    "unknown label": (["--labels", "smell"], "smell"),
    "unknown renderer": (["--renderer", "povray"], "povray"),
    "no samples": (["--samples", "0"], "samples"),
    "nothing asked for": (["--labels", "none", "--labels-only"], "no file"),
    "unknown image format": (["--image-format", "bmp"], "bmp"),
    "frames that select none": (["--frames", "5:9"], "5:9"),
}


@pytest.mark.parametrize("name", BAD_RENDERS)
def test_render_refuses_bad_options(good_stage, tmp_path, spin_usd, name) -> None:
    options, word = BAD_RENDERS[name]
    refused(spin_usd, ["render", good_stage, "--out", tmp_path / "data", *options], word)
    assert [p.name for p in tmp_path.iterdir()] == ["stage.usda"]


SIXTEEN_BITS = CAMERA.replace('["SpinLensAPI"]', '["SpinLensAPI", "SpinSensorAPI"]').replace(
    "cy = 20", "cy = 20\nint spin:sensor:bitDepth = 16"
)


def test_images_that_their_format_cannot_hold_are_refused_before_anything_is_made(tmp_path, spin_usd) -> None:
    (tmp_path / "stage.usda").write_text(stage(SIXTEEN_BITS, TARGET))
    for command in (["render", "--out", tmp_path / "data"], ["plan"]):
        options = ["--renderer", "raycast", "--image-format", "jpg"]
        sentence = refused(spin_usd, [*command, tmp_path / "stage.usda", *options], "choose --image-format png")
        assert "/World/Camera.spin:sensor:bitDepth: is 16" in sentence
    assert [p.name for p in tmp_path.iterdir()] == ["stage.usda"]
    spin_usd("plan", tmp_path / "stage.usda", *options, "--labels-only")


def test_labels_that_cannot_hold_so_many_targets_are_refused_before_anything_is_made(tmp_path, spin_usd) -> None:
    targets = [TARGET.replace('"Target"', f'"Target_{number}"') for number in range(17)]
    (tmp_path / "stage.usda").write_text(stage(CAMERA, *targets))
    command = ["render", tmp_path / "stage.usda", "--out", tmp_path / "data", "--labels", "depth,mask_amodal"]
    refused(spin_usd, [*command, "--quiet"], "has 17 targets, and the label mask_amodal holds 16 at most")
    assert [p.name for p in tmp_path.iterdir()] == ["stage.usda"]
    spin_usd(*command[:-1], "all", "--labels-only", "--renderer", "raycast")
    made = {path.name for path in (tmp_path / "data").iterdir()}
    assert "instance" in made
    assert not made & {"mask_visible", "mask_amodal"}


@pytest.mark.parametrize("twice", [["--samples", "2", "--samples", "3"], ["--seed=1", "--seed", "1"]])
def test_an_option_given_twice_is_wrong_usage(good_stage, spin_usd, twice) -> None:
    assert f"'{twice[0][:6]}" in spin_usd("plan", good_stage, *twice, code=2).stderr
    spin_usd("plan", good_stage, *twice[-2:], "--json", "--json")


def test_render_refuses_a_folder_of_something_else(good_stage, tmp_path, spin_usd) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "thesis.tex").write_text("precious")
    refused(spin_usd, ["render", good_stage, "--out", tmp_path / "data"], "dataset.json")
    assert [p.name for p in (tmp_path / "data").iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("out", ["stage.usda/data", "/proc/spin_usd"])
def test_render_refuses_where_it_cannot_write(good_stage, tmp_path, spin_usd, out) -> None:
    refused(spin_usd, ["render", good_stage, "--out", tmp_path / out], "written")


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["render", "gone.usda", "--out", "data"], "gone.usda"),
        (["plan", "gone.usda"], "gone.usda"),
        (["check", "gone"], "gone"),
        (["reproduce", "gone", "img000001"], "gone"),
    ],
)
def test_what_does_not_exist_is_named(tmp_path, spin_usd, arguments, word) -> None:
    done = spin_usd(*arguments, code=2, cwd=tmp_path)
    assert word in done.stderr
    assert not list(tmp_path.iterdir())


def test_wrong_usage_has_the_same_exit_code(spin_usd) -> None:
    assert "Missing argument" in spin_usd("render", "--out", "data", code=2).stderr
    assert "levitate" in spin_usd("levitate", code=2).stderr
