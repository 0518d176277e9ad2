"""Colours behind an OBJ's points, which MeshLab and others write: trimesh reads the same ones."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.scene.derived import srgb
from spin_usd.scene.texture import Primvar
from tests.formats.mesh.conftest import png

POINTS = "v 0 0 0 1 0 0\nv 1 0 0 0.25 0.5 1\nv 0 1 0 0 0 1\nvt 0 0\n"
SHOWN = Primvar(name="displayColor")


def test_colours_are_those_of_trimesh(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text(f"{POINTS}f 3 1 2\n")
    asset = read_mesh_file(path, 1)
    (part,) = asset.parts
    assert asset.materials[part.face_material[0]].constants.diffuse_color == SHOWN
    theirs = trimesh.load_mesh(path, process=False).visual.vertex_colors[[2, 0, 1], :3] / 255
    assert np.allclose(srgb.encode(part.primvars["displayColor"]), theirs, rtol=0, atol=1 / 255)
    assert asset.notes == ("its colours are taken as sRGB",)


def test_colours_up_to_255_and_points_without(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0 255 0 0\nv 1 0 0\nv 0 1 0 0 0 255\nf 1 2 3\n")
    (part,) = read_mesh_file(tmp_path / "a.obj", 1).parts
    assert part.primvars["displayColor"].tolist() == [[1, 0, 0], [1, 1, 1], [0, 0, 1]]


def test_they_multiply_what_a_material_says_and_stand_for_what_it_does_not(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl half\nKd 0.5 0.5 0.5\nPr 0.25\nnewmtl image\nmap_Kd a.png\n")
    (tmp_path / "a.png").write_bytes(png(np.zeros((2, 2, 3))))
    faces = "usemtl half\nf 1 2 3\nusemtl unknown\nf 1 2 3\nusemtl image\nf 1/1 2/1 3/1\n"
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{POINTS}f 1 2 3\n{faces}")
    asset = read_mesh_file(tmp_path / "a.obj", 1)
    (part,) = asset.parts
    none, half, unknown, image = (asset.materials[index] for index in part.face_material)
    assert [each.constants.diffuse_color == SHOWN for each in (none, half, unknown)] == [True] * 3
    assert half.constants.roughness == 0.25
    assert "diffuseColor" in image.images
    assert [color[0] for color in part.primvars["displayColor"][::3]] == [1, 0.5, 1, 1]
    assert any("UsdPreviewSurface cannot multiply" in note for note in asset.notes)


def test_a_fourth_number_is_no_colour(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n")
    assert read_mesh_file(tmp_path / "a.obj", 1).materials == ()


FLOAT_PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property float red
property float green
property float blue
element face 1
property list uchar int vertex_indices
end_header
"""


@pytest.mark.parametrize("suffix", ["obj", "ply"])
@pytest.mark.parametrize(
    ("colors", "full", "outside"),
    [
        ("0.5 0.5 0.5, 1 0.25 0, 0 0 0.125", 1, 0),
        ("1.000001 0.5 0.5, 1 0.25 0, 0 0 0.125", 1, 1),
        ("3.5 0.5 -0.25, 1 0.25 0, 0 0 1.004", 1, 2),
        ("2 0 0, 1 1 1, 0 0 1", 255, 0),
        ("127.5 0.5 0.5, 1 0.25 0, 0 0 300.5", 255, 1),
    ],
)
def test_colours_reach_to_255_only_where_they_look_like_it(tmp_path: Path, suffix, colors, full, outside) -> None:
    rows, faces = colors.split(", "), {"obj": "f 1 2 3\n", "ply": "3 0 1 2\n"}
    begin = {"obj": "v ", "ply": ""}[suffix]
    points = "".join(f"{begin}{place} {row}\n" for place, row in zip(("0 0 0", "1 0 0", "0 1 0"), rows, strict=True))
    path = tmp_path / f"a.{suffix}"
    path.write_text((FLOAT_PLY if suffix == "ply" else "") + points + faces[suffix])
    asset = read_mesh_file(path, 1)
    want = srgb.decode(np.clip(np.array([[float(n) for n in row.split()] for row in rows]) / full, 0, 1))
    assert np.allclose(asset.parts[0].primvars["displayColor"], want, rtol=0, atol=1e-6)
    told = [f"at {outside} of its 3 corners a colour is not within 0 and {full}: the nearest there was taken"]
    assert list(asset.notes) == ["its colours are taken as sRGB", *told[:outside]]
