"""MTL as its exporters write it: what d and Tr mean, where libraries lie, numbers that no surface has."""

from pathlib import Path

import pytest

from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.scene.asset import MeshAsset

OBJ = "usemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl b\nf 3 2 1\n"


def read(folder: Path, library: str, named: str = "lib.mtl", file: str = "lib.mtl") -> MeshAsset:
    """The model whose `file` beside it holds `library` and which names it `named`."""
    (folder / file).parent.mkdir(parents=True, exist_ok=True)
    (folder / file).write_text(library)
    (folder / "model.obj").write_text(f"mtllib {named}\n{OBJ}")
    return read_mesh_file(folder / "model.obj", 1)


@pytest.mark.parametrize(
    ("a", "b", "opacities", "said"),
    [
        ("Tr 1.0", "Tr 1.0", (1, 1), "MeshLab"),  # MeshLab, openMVS, mvs-texturing: opaque
        ("Tr 1.0", "Tr 0.25", (1, 0.25), "MeshLab"),
        ("Tr 0.0", "Tr 0.25", (1, 0.75), "opacity 0.75"),  # 3ds Max, Blender, three.js: 1 - d
        ("Tr 0.0", "Tr 1.0", (1, 0), "opacity 0"),
        ("d 1\nTr 0", "Tr 0\nd 0.25\nTr 0.75", (1, 0.25), None),  # both stand and agree, in any order
        ("d 1\nTr 1", "d 1", (1, 1), "contradict"),  # IfcOpenShell
        ("d 0.5", "", (0.5, 1), None),
        ("d -halo 0.5", "", (0.5, 1), "-halo"),
    ],
)
def test_what_exporters_mean_by_d_and_tr(
    tmp_path: Path, a: str, b: str, opacities: tuple[float, float], said: str | None
) -> None:
    asset = read(tmp_path, f"newmtl a\n{a}\nnewmtl b\n{b}\n")
    assert tuple(material.constants.opacity for material in asset.materials) == opacities
    assert any(said in note for note in asset.notes) if said else asset.notes == ()


@pytest.mark.parametrize(
    ("named", "file"),
    [
        ("./lib.mtl", "lib.mtl"),
        ("folder/lib.mtl", "folder/lib.mtl"),
        ("folder\\lib.mtl", "folder/lib.mtl"),
        (".\\lib.mtl", "lib.mtl"),
        ("my  own lib.mtl", "my  own lib.mtl"),
        ("lib.mtl  ", "lib.mtl"),
        ("\tlib.mtl", "lib.mtl"),
    ],
)
def test_a_library_is_found_where_it_is(tmp_path: Path, named: str, file: str) -> None:
    asset = read(tmp_path, "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n", named, file)
    assert [material.constants.diffuse_color for material in asset.materials] == [(1, 0, 0), (0, 1, 0)]
    assert asset.notes == ()


def test_one_statement_may_name_several_libraries(tmp_path: Path) -> None:
    (tmp_path / "other.mtl").write_text("newmtl b\nKd 0 1 0\n")
    asset = read(tmp_path, "newmtl a\nKd 1 0 0\n", "lib.mtl other.mtl")
    assert [material.constants.diffuse_color for material in asset.materials] == [(1, 0, 0), (0, 1, 0)]


def test_numbers_that_no_surface_has_are_moved_with_a_note(tmp_path: Path) -> None:
    asset = read(tmp_path, "newmtl a\nNs -1.960784\nKd 1.2 0.5 0\nnewmtl b\nNs 0\n")
    a, b = (material.constants for material in asset.materials)
    assert (a.roughness, a.diffuse_color) == (b.roughness, (1, 0.5, 0))
    assert [note.split(" is not")[0] for note in asset.notes] == [
        "material 'a' of lib.mtl: Ns -1.960784",
        "material 'a' of lib.mtl: Kd 1.2 0.5 0",
    ]


def test_texts_in_utf_16_and_with_tabs(tmp_path: Path) -> None:
    (tmp_path / "model.obj").write_text(OBJ.replace(" ", "\t", 9), encoding="utf-16")
    assert read_mesh_file(tmp_path / "model.obj", 1).faces == 2
