"""What is damaged is the input's fault: a sentence or a finding, never a defect of ours."""

import json
import random
import shutil
import subprocess
import sys
from contextlib import suppress

import pytest

from spin_usd.commands.check.calls import CHECK_STAGE, CheckStage
from spin_usd.errors import SpinError
from spin_usd.files.sha256 import sha256_of
from tests.hostile.conftest import CAMERA, RECORD, slow
from tests.hostile.test_outside import HEAD
from tests.test_bad_inputs import CAMERA as CAMERA_PRIM
from tests.test_bad_inputs import TARGET, stage

# What stands in place of what in a good stage.
TYPES = {
    "unknown type of a lens": ("double spin:lens:fx = 100", "dkuble spin:lens:fx = 100"),
    "unknown type of labels": ("def Mesh", 'poken[] semantics:labels:class = ["a"]\n        def Mesh'),
    "unknown type of a position": ("double3 xformOp:translate", "doubleX xformOp:translate"),
    "unknown type of counts": ("int[] faceVertexCounts", "intX[] faceVertexCounts"),
    "unknown type of a size": ("int2 spin:lens:imageSize = (64, 40)", "int9 spin:lens:imageSize = 64"),
    "lens of text": ("double spin:lens:fx = 100", 'string spin:lens:fx = "x"'),
    "counts of text": ("int[] faceVertexCounts = [3]", 'string faceVertexCounts = "x"'),
    "position of text": ("double3 xformOp:translate = (0, 0, -5)", 'string xformOp:translate = "x"'),
    "position of a number": ("double3 xformOp:translate = (0, 0, -5)", "float xformOp:translate = 1"),
    "position of a file": ("double3 xformOp:translate = (0, 0, -5)", "asset xformOp:translate = @a@"),
    "position of many": ("double3 xformOp:translate = (0, 0, -5)", "double3[] xformOp:translate = [(0, 0, 0)]"),
    "lens polynomial of 1e300": (
        "double spin:lens:fx = 100",
        "double spin:lens:fx = 100\n        double spin:lens:k1 = 1e300",
    ),
    "normals between what USD does not have": (
        "int[] faceVertexCounts",
        'normal3f[] normals = [(0, 0, 1)] (interpolation = "somewhere")\n        int[] faceVertexCounts',
    ),
    "primvar between what USD does not have": (
        "int[] faceVertexCounts",
        'color3f[] primvars:displayColor = [(0, 0, 1)] (interpolation = "")\n        int[] faceVertexCounts',
    ),
    "token that its schema does not allow": (
        "int[] faceVertexCounts",
        'uniform token orientation = "upsideDown"\n        int[] faceVertexCounts',
    ),
    "metersPerUnit of 0": ("metersPerUnit = 1", "metersPerUnit = 0"),
    "metersPerUnit of 1e300": ("metersPerUnit = 1", "metersPerUnit = 1e300"),
    "metersPerUnit of 1e-320": ("metersPerUnit = 1", "metersPerUnit = 1e-320"),
    "scale of 1e300": (
        '"xformOp:translate", "xformOp:orient"]',
        '"xformOp:translate", "xformOp:orient", "xformOp:scale"]\n        float3 xformOp:scale = (1e300, 1, 1)',
    ),
}


@pytest.mark.parametrize("name", TYPES)
def test_a_value_of_another_type_or_an_extreme_one_is_told(checked, tmp_path, name) -> None:
    text = stage(CAMERA_PRIM, TARGET)
    assert TYPES[name][0] in text
    (tmp_path / "stage.usda").write_text(text.replace(*TYPES[name]))
    assert checked(tmp_path / "stage.usda")


def test_a_byte_that_is_not_utf8_is_told(checked, tmp_path) -> None:
    (tmp_path / "a.usda").write_bytes(b"#usda 1.0\n#\xff\n")
    assert checked(tmp_path / "a.usda")


@pytest.mark.parametrize(
    "command", [("check",), ("author",), *map(slow, (("plan",), ("render", "--out", "d"), ("diff", "a", "b")))]
)
def test_a_byte_that_is_not_utf8_is_no_defect_in_any_command(place, spin_usd, command) -> None:
    (place.folder / "a.usda").write_bytes(b"#usda 1.0\n#\xff\n{")
    given = place.author("--target", "a.usda") if command == ("author",) else (command[0], "a.usda", *command[1:])
    code = 1 if command == ("check",) else 2
    done = spin_usd(*given, cwd=place.folder, code=code)
    assert "internal" not in done.stderr


def test_a_binary_layer_that_is_damaged_where_it_is_read_late_is_told(child, place) -> None:
    (layer,) = place.stage.glob("targets/*/geometry.usdc")
    whole, rng = layer.read_bytes(), random.Random(1)
    for _ in range(20):
        at = rng.randrange(len(whole) - 16)
        layer.write_bytes(whole[:at] + b"\xff" * 16 + whole[at + 16 :])
        with suppress(SpinError):  # a defect is none
            child.call(CHECK_STAGE, CheckStage(stage=str(place.stage / "dataset.usda")), progress=lambda *_: None)


@pytest.mark.parametrize("k1", [1e300, slow(1e-320), slow(float("inf"))])
def test_a_lens_of_extreme_numbers_is_refused(place, spin_usd, k1) -> None:
    (place.folder / "camera.json").write_text(json.dumps({**CAMERA, "distCoeffs": [k1, 0, 0, 0, 0]}))
    done = spin_usd(*place.author(), cwd=place.folder, code=2)
    assert "internal" not in done.stderr


def damage(place, name, content):
    """Write `content` into a file of the dataset, whose digest agrees."""
    (place.dataset / name).write_bytes(content)
    digest = sha256_of(place.dataset / name)

    def sealed(record):
        record["files"][name.partition("/")[0]]["sha256"] = digest

    place.change(RECORD, sealed)


@pytest.mark.parametrize("kind", ["depth", slow("image"), slow("segmentation")])
def test_pictures_that_cannot_be_decoded_are_findings_and_others_are_found_too(place, spin_usd, kind) -> None:
    (file,) = (place.dataset / kind / "nominal").iterdir()
    whole = file.read_bytes()
    damaged = bytearray(whole)
    damaged[len(whole) // 3 : len(whole) // 3 + 40] = b"\xff" * 40
    name = str(file.relative_to(place.dataset))
    damage(place, name, bytes(damaged[: len(whole) * 2 // 3]))
    (place.dataset / kind / "nominal" / "stray.png").touch()
    found = spin_usd("check", "ds", cwd=place.folder, code=1)
    assert name in found.stdout + found.stderr
    assert "stray.png" in found.stdout + found.stderr


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # numpy warns of such numbers, and goes on
@pytest.mark.parametrize(
    "change",
    [
        lambda record: record["camera"].update(distortion=[1e308, 0, 0, 0, 0]),
        slow(lambda record: record["pose"].update(q_cam_body=[2, 0, 0, 0])),
        slow(lambda record: record["targets"][0]["pose"].update(q_cam_body=[0, 0, 0, 0])),
        slow(lambda record: record["targets"][0]["pose"].update(t_cam_body=[0, 0, 1e308])),
        slow(lambda record: record["targets"][0]["pose"].update(t_cam_body=[0, 0, 1e-320])),
        slow(lambda record: record["targets"][0]["box"].update(visible=[float("inf")] * 4)),
        slow(lambda record: record.update(targets=[])),
    ],
    ids=["lens", "norm 2", "norm 0", "far", "near", "box", "no target"],
)
def test_a_record_of_impossible_numbers_is_a_finding(place, spin_usd, change) -> None:
    place.change(RECORD, change)
    assert spin_usd("check", "ds", cwd=place.folder, code=1).stdout


@pytest.mark.parametrize(
    "change",
    [
        lambda record: record.update(targets=[]),
        slow(lambda record: record["targets"][0]["box"].update(visible=[float("nan")] * 4)),
        slow(lambda record: record["targets"][0]["box"].update(visible=[1, 2, 3])),
    ],
    ids=["no target", "NaN", "three numbers"],
)
def test_an_export_names_the_record_that_breaks_its_schema(place, spin_usd, change) -> None:
    place.change(RECORD, change)
    refused = spin_usd("export", "ds", "--to", "coco", "--out", "out", cwd=place.folder, code=2)
    assert f"{RECORD}: " in refused.stderr


def test_a_record_of_a_stage_elsewhere_whose_numbers_are_not_finite_is_made_again(place, spin_usd) -> None:
    """It says another place in the stage, so it would be written again as it is."""
    place.change(RECORD, lambda record: record.update(index=7, exposure_gain=float("nan")))
    spin_usd(*place.render(), cwd=place.folder)
    assert json.loads((place.dataset / RECORD).read_text())["index"] == 0


def test_a_record_of_a_kind_that_is_not_made_is_refused_by_reproduce(place, spin_usd) -> None:
    place.change(RECORD, lambda record: record["files"].update(token=record["files"].pop("depth")))
    refused = spin_usd("reproduce", "ds", "img000001", cwd=place.folder, code=2)
    assert "lists token" in refused.stderr


@pytest.mark.parametrize("name", [RECORD, slow("cache/measured.json")])
def test_brackets_without_end_are_no_defect(place, spin_usd, name) -> None:
    (place.dataset / name).write_text("[" * 200_000)
    done = spin_usd(*place.render(), cwd=place.folder)
    assert "internal" not in done.stderr


def test_a_specification_of_brackets_without_end_is_refused(place, spin_usd) -> None:
    (place.folder / "deep.toml").write_text("a = " + "[" * 200_000)
    assert "deep.toml" in spin_usd("augment", "st", "--spec", "deep.toml", cwd=place.folder, code=2).stderr


@pytest.mark.parametrize("name", ["stage", slow(".work"), slow("x.tmp-y")])
def test_a_file_or_link_where_a_folder_of_ours_belongs_blocks_no_later_run(place, spin_usd, name) -> None:
    kept = place.folder / "kept"
    shutil.copytree(place.dataset, kept)
    if name == "stage":
        shutil.rmtree(place.dataset / name)
    (place.dataset / name).symlink_to(place.users)
    code = 2 if name == "stage" else 0
    for _ in range(2):
        done = spin_usd(*place.render(), cwd=place.folder, code=code)
        assert "internal" not in done.stderr
    (place.dataset / name).unlink()
    if name == "stage":
        shutil.copytree(kept / name, place.dataset / name)
    spin_usd(*place.render(), cwd=place.folder)
    assert {p.name for p in place.dataset.iterdir()} == {p.name for p in kept.iterdir()}


@pytest.mark.parametrize(("name", "code"), [(RECORD, 1), slow("image", 2), slow("cache", 2), slow(".work", 0)])
def test_a_folder_for_a_file_and_a_file_for_a_folder_are_told(place, spin_usd, name, code) -> None:
    path = place.dataset / name
    if path.is_dir():
        shutil.rmtree(path)
        path.touch()
    elif name == ".work":
        path.touch()
    else:
        path.unlink()
        path.mkdir()
    done = spin_usd(*place.render(), cwd=place.folder, code=code)
    assert "internal" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["usda", "usdz"])
def test_a_target_of_60000_nested_prims_is_refused_and_leaves_nothing(place, spin_usd, kind) -> None:
    depth = 60_000
    (place.folder / "deep.usda").write_text(HEAD + 'def "A"\n{\n' * depth + "}\n" * depth)
    if kind == "usdz":
        script = "from pxr import Sdf; w = Sdf.ZipFileWriter.CreateNew('deep.usdz'); w.AddFile('deep.usda'); w.Save()"
        subprocess.run([sys.executable, "-c", script], cwd=place.folder, check=True)
    spin_usd(*place.author("--target", f"deep.{kind}"), cwd=place.folder, code=2)
    assert not (place.folder / "out").exists()
    assert not [p for p in place.folder.iterdir() if p.name.startswith(".")]


STATEMENTS = {
    "lists of numbers within lists (OpenUSD 4214)": "def Mesh 'm' { int[] a = " + "[" * 250 + "-1.",
    "lists of numbers without a bound (OpenUSD 4214)": "def Mesh 'm' { int[] a = " + "[-1, " * 200_000,
    "tuples that never end (OpenUSD 4215)": "def Mesh 'm' { float3 a = " + "(" * 250 + "1",
    "tuples without a bound (OpenUSD 4215)": "def Mesh 'm' { float3 a = " + "(" * 200_000 + "1",
    "a prim after a broken path (OpenUSD 4217)": "def Mesh '' { def '' { def 'a' (a = ''){ def Mesh 'b' () {} } } }",
    "prims of no type in one another (OpenUSD 4217)": "def def class over 'a' { def { over class 'b' {} } }",
    "a variant set outside prims (OpenUSD 4218)": "variantSet 'v' = { 'x' { variantSet 'w' = { 'y' { } } }",
    "variants within variants (OpenUSD 4218)": "def 'a' { variantSet '' = { '' { variantSet '' = { '' { } } } } } }",
    "a name that nothing can have (OpenUSD 1730)": "(e='' D={string a=''})def''{def''{def''(a=''){l r e t=<>\n}}}",
}


@pytest.mark.children
@pytest.mark.parametrize("name", STATEMENTS)
def test_statements_like_those_that_broke_usds_parser_are_a_sentence(spin_usd, tmp_path, name) -> None:
    """The reports' own inputs are not public: these are of their kinds."""
    model = tmp_path / "model.usda"
    model.write_text(f"#usda 1.0\n{STATEMENTS[name]}\n")
    given = ("--sample", "range=5 count=1", "--camera", "speedplus", "--out", tmp_path / "out")
    done = spin_usd("author", "--target", model, *given, code=2)
    assert "model.usda" in done.stderr
    assert "internal error" not in done.stderr
    assert not (tmp_path / "out").exists()
