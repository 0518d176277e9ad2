"""author compares what it wrote with what another reader finds in the model's file: faults are caught, others pass."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from spin_usd.commands.author.in_child import author_stage
from spin_usd.commands.author.reports import AuthorReport
from spin_usd.commands.author.written_target import check_written
from spin_usd.errors import InputError
from spin_usd.stage.author.target_asset import describe
from spin_usd.stage.read.stage_reader import StageReader

POSES = [{"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 25]}]
TRIANGLE = "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\npoint3f[] points = "
FLAT = f'uniform token subdivisionScheme = "none"\n{TRIANGLE}'
FAR = "[(0, 0, 0), (9000, 0, 0), (0, 9000, 0)]"
BONE = "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))"
API = '(\nprepend apiSchemas = ["SkelBindingAPI"]\n)'
SKINNED = f"""def SkelRoot "Craft" {{
    def Skeleton "Bones" {API} {{
        uniform token[] joints = ["bone"]
        uniform matrix4d[] bindTransforms = [{BONE}]
        uniform matrix4d[] restTransforms = [{BONE}]
        rel skel:animationSource = </W/Craft/Walk>
    }}
    def SkelAnimation "Walk" {{
        uniform token[] joints = ["bone"]
        float3[] translations.timeSamples = {{
            -1: [(-800, 0, 0)],
            1: [(800, 0, 0)],
        }}
        quatf[] rotations = [(1, 0, 0, 0)]
        half3[] scales = [(8, 8, 8)]
    }}
    def Mesh "Skin" {API} {{
        {FLAT}[(0, 0, 0), (100, 0, 0), (0, 50, 0)]
        rel skel:skeleton = </W/Craft/Bones>
        int[] primvars:skel:jointIndices = [0] (
            interpolation = "constant"
        )
        float[] primvars:skel:jointWeights = [1] (
            interpolation = "constant"
        )
    }}
}}"""  # its one joint has no extent, and stands at the origin between two samples
TETRAHEDRON = """def Mesh "Loop" {
    double3 xformOp:scale = (900, 900, 900)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    uniform token subdivisionScheme = "loop"
    int[] faceVertexCounts = [3, 3, 3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2]
    point3f[] points = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
}"""
CAGE = trimesh.creation.box((100, 100, 100))


def usd(body: str, root: str = "Xform") -> str:
    head = '#usda 1.0\n(\ndefaultPrim = "W"\nmetersPerUnit = 0.01\nupAxis = "Z"\n)\n'
    return f'{head}def {root} "W"\n{{\ndef Mesh "M" {{\n{FLAT}[(0, 0, 0), (100, 0, 0), (0, 50, 0)]\n}}\n{body}\n}}\n'


def author(folder: Path, target: Path, units: float | None = None) -> AuthorReport:
    (folder / "poses.json").write_text(json.dumps(POSES))
    shutil.rmtree(folder / "stage", ignore_errors=True)
    poses, out = folder / "poses.json", folder / "stage"
    return author_stage(poses=poses, out=out, target=target, camera="speedplus", units_per_metre=units)


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "glb", "usda"])
def test_another_size_than_the_files_is_refused_with_both(tmp_path: Path, suffix: str) -> None:
    target = tmp_path / f"model.{suffix}"
    if suffix == "usda":
        target.write_text(usd(""))
    else:
        trimesh.creation.box((2, 3, 4)).export(target)
    report = author(tmp_path, target, None if suffix in ("glb", "usda") else 10)
    assert not [note for note in report.notes if "could not be compared" in note]
    root, other = Path(report.root), tmp_path / f"other.{suffix}"
    asset = describe(root.parent / "targets" / "model" / "model.usda", "model")
    if suffix == "usda":
        other.write_text(usd("").replace("metersPerUnit = 0.01", "metersPerUnit = 0.0101"))
        expected = r"1\.01 x 0\.505 x 0 m .* but 1 x 0\.5 x 0 m"
    else:
        trimesh.creation.box((2, 3, 4.04)).export(other)
        expected = (
            "2 x 3 x 4.04 m .* but 2 x 3 x 4 m" if suffix == "glb" else "0.2 x 0.3 x 0.404 m .* but 0.2 x 0.3 x 0.4 m"
        )
    with pytest.raises(InputError, match=f"other.{suffix}.*{expected}"):
        check_written(StageReader(root), other, asset, None if suffix == "glb" else 10, {})


def test_a_part_that_was_lost_or_a_unit_taken_twice_is_refused(tmp_path: Path) -> None:
    """What a subdivided cage or a Cube bounds is known loosely, polygons among them exactly."""
    cube = 'def Cube "C" {\ndouble size = 10\n}\n'
    target, with_more, larger = (tmp_path / f"{name}.usda" for name in ("model", "more", "larger"))
    target.write_text(usd(cube))
    root = Path(author(tmp_path, target).root)
    asset = describe(root.parent / "targets" / "model" / "model.usda", "model")
    with_more.write_text(usd(f'{cube}def Mesh "Lost" {{\n{FLAT}[(0, 0, 0), (0, 0, 60), (0, 50, 0)]\n}}'))
    with pytest.raises(InputError, match=r"1\.05 x 0\.55 x 0\.65 m .* but 1\.05 x 0\.55 x 0\.1 m"):
        check_written(StageReader(root), with_more, asset, None, {})
    larger.write_text(usd(cube).replace("0.01", "1"))
    with pytest.raises(InputError, match=r"105 x 55 x 10 m .* but 1\.05 x 0\.55 x 0\.1 m"):
        check_written(StageReader(root), larger, asset, None, {})


@pytest.mark.parametrize(
    "body",
    [
        "",
        f'def Mesh "Hidden" {{\ntoken visibility = "invisible"\n{FLAT}{FAR}\n}}',
        f'def Mesh "Guide" {{\nuniform token purpose = "guide"\n{FLAT}{FAR}\n}}',
        'def Points "Keypoints" {\nuniform token purpose = "guide"\npoint3f[] points = [(9000, 0, 0)]\n}',
        f'def Mesh "Stale" {{\nfloat3[] extent = [(-9000, -9000, -9000), (9000, 9000, 9000)]\n{FLAT}[(0, 0, 0), '
        "(1, 0, 0), (0, 1, 0)]\n}",
        f'def Mesh "Unused" {{\n{FLAT}[(0, 0, 0), (1, 0, 0), (0, 1, 0), (9000, 9000, 9000)]\n}}',
        f'def Mesh "Spike" {{\n{FLAT.replace("[3]", "[3, 3]").replace("[0, 1, 2]", "[0, 1, 2, 0, 3, 3]")}[(0, 0, 0), '
        "(1, 0, 0), (0, 1, 0), (9000, 9000, 9000)]\n}",
        f'def Mesh "Rod" {{\ndouble3 xformOp:rotateXYZ = (0, -35.26, 45)\nuniform token[] xformOpOrder = '
        f'["xformOp:rotateXYZ"]\n{FLAT}[(0, 0, 0), (300, 300, 300), (300, 300, 301)]\n}}',
        'def Sphere "S" {\ndouble radius = 80\n}',
        f'def Mesh "Cage" {{\nint[] faceVertexCounts = {[3] * 12}\n'
        f"int[] faceVertexIndices = {CAGE.faces.ravel().tolist()}\n"
        f"point3f[] points = {[tuple(p) for p in CAGE.vertices.tolist()]}\n}}",
        f'def PointInstancer "I" {{\nint[] protoIndices = [0, 0]\npoint3f[] positions = [(0, 0, 0), (500, 0, 0)]\n'
        f'rel prototypes = </W/I/P>\ndef Mesh "P" {{\n{FLAT}[(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}}\n}}',
        'def PointInstancer "I" {\nint[] protoIndices = [0, 0]\npoint3f[] positions = [(0, 0, 0), (500, 0, 0)]\n'
        'rel prototypes = </W/I/P>\ndef Sphere "P" {\ndouble radius = 20\n}\n}',  # many faces, kept once
        'def Xform "A" (\ninstanceable = true\nreferences = </W/Source>\n) {\ndouble3 xformOp:translate = (0, 0, 70)\n'
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
        f'def Xform "Source" {{\ndef Mesh "M" {{\n{FLAT}[(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}}\n}}',
        SKINNED,
        TETRAHEDRON,
    ],
)
def test_what_is_right_passes(tmp_path: Path, body: str) -> None:
    target = tmp_path / "model.usda"
    target.write_text(usd(body))
    usual = re.compile("moves by itself|body axes are|overlap others")
    assert not [note for note in author(tmp_path, target).notes if not usual.search(note)]


def test_a_mesh_file_with_points_and_spikes_that_no_picture_shows_passes(tmp_path: Path) -> None:
    target = tmp_path / "model.obj"
    target.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 99 99 99\nf 1 2 3\nf 1 4 4\n")
    assert author(tmp_path, target, 1).notes[0] == "1 of 2 faces have no area: dropped"


def test_a_mirrored_turned_and_scaled_gltf_passes(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    turn = trimesh.transformations.compose_matrix(
        angles=(0.3, 0.2, 0.1), translate=(0.1, 0.2, 0.3), scale=(1, -1.5, 0.5)
    )
    scene.add_geometry(trimesh.creation.box((2, 3, 4)), transform=turn)
    scene.export(tmp_path / "model.glb")
    (note,) = author(tmp_path, tmp_path / "model.glb").notes
    assert "calls y up" in note


def test_the_real_tango_is_as_large_as_trimesh_says(shared: Path, tmp_path: Path) -> None:
    target = shared / "data" / "tango" / "tango.obj"
    assert not [note for note in author(tmp_path, target, 100).notes if "compared" in note]
    size = np.ptp(trimesh.load_mesh(target, process=False).triangles.reshape(-1, 3), axis=0) / 100
    root, other = tmp_path / "stage" / "dataset.usda", tmp_path / "other.usda"
    asset = describe(root.parent / "targets" / "tango" / "tango.usda", "tango")
    other.write_text(usd(""))
    with pytest.raises(InputError, match=f"but {size[0]:.6g} x {size[1]:.6g} x {size[2]:.6g} m"):
        check_written(StageReader(root), other, asset, None, {})
