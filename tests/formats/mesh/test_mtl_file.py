"""MTL as its exporters write it: what d and Tr mean, where libraries lie, numbers that no surface has, maps and
their options."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.scene.asset import ImageMap, ImageTransform, MeshAsset
from tests.formats.mesh.conftest import png

OBJ = "usemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl b\nf 3 2 1\n"
MAPPED_OBJ = """mtllib model.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0.1 0.2
vt 0.9 0.3
vt 0.8 0.7
vt 0.4 1.5
usemtl paint
f 1/1 2/2 3/3 4/4
"""
COLORED = np.random.default_rng(5).integers(0, 255, (4, 4, 3))
GREY = np.repeat(COLORED[..., :1], 3, axis=-1)
CLEAR = np.concatenate([COLORED, COLORED[..., :1]], -1)


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


def read_map(folder: Path, statements: str, obj: str = MAPPED_OBJ) -> MeshAsset:
    for name, pixels in {"colored": COLORED, "grey": GREY, "clear": CLEAR}.items():
        (folder / f"{name}.png").write_bytes(png(pixels))
    (folder / "model.mtl").write_text(f"newmtl paint\n{statements}\n")
    (folder / "model.obj").write_text(obj)
    return read_mesh_file(folder / "model.obj", 1)


def only(asset: MeshAsset) -> tuple[str, ImageMap]:
    ((name, image),) = asset.materials[0].images.items()
    return name, image


def test_coordinates_and_colours_are_trimeshs(tmp_path: Path) -> None:
    asset = read_map(tmp_path, "Kd 1 1 1\nmap_Kd colored.png")
    theirs = next(iter(trimesh.load_scene(tmp_path / "model.obj", process=False).geometry.values()))
    (part,) = asset.parts
    ours = dict(zip(map(tuple, part.points[part.face_indices]), part.primvars["st"].tolist(), strict=True))
    assert ours == dict(zip(map(tuple, theirs.vertices), theirs.visual.uv.tolist(), strict=True))
    name, image = only(asset)
    assert (name, image.color_space, image.scale) == ("diffuseColor", "sRGB", (1, 1, 1, 1))
    assert image.file.data == (tmp_path / "colored.png").read_bytes()
    assert np.array_equal(np.array(theirs.visual.material.image), COLORED)


@pytest.mark.parametrize(
    ("statements", "name", "output", "scale"),
    [
        ("map_Kd grey.png\nKd 0.5 0.25 1", "diffuseColor", "rgb", (0.5, 0.25, 1, 1)),  # in any order
        ("map_Kd grey.png", "diffuseColor", "rgb", (1, 1, 1, 1)),
        ("Ke 3 2 1\nmap_Ke colored.png", "emissiveColor", "rgb", (3, 2, 1, 1)),
        ("d 0.5\nmap_d clear.png", "opacity", "a", (0.5,) * 4),
        ("d 0.25\nTr 0.75\nmap_d grey.png", "opacity", "r", (0.25,) * 4),
        ("map_d -imfchan g clear.png", "opacity", "g", (1,) * 4),
        ("map_d -imfchan m clear.png", "opacity", "a", (1,) * 4),
        ("map_Pr grey.png", "roughness", "r", (1,) * 4),
        ("Pm 0.5\nmap_Pm -imfchan b colored.png", "metallic", "b", (0.5,) * 4),
        ("norm colored.png", "normal", "rgb", (2, 2, 2, 1)),
    ],
)
def test_a_map_is_multiplied_by_its_constant(
    tmp_path: Path, statements: str, name: str, output: str, scale: tuple[float, ...]
) -> None:
    asset = read_map(tmp_path, statements)
    found, image = only(asset)
    assert (found, image.output, image.scale) == (name, output, scale)
    assert image.color_space == ("sRGB" if name.endswith("Color") else "raw")
    assert image.bias == ((-1, -1, -1, 0) if name == "normal" else (0, 0, 0, 0))
    assert asset.notes == ()


@pytest.mark.parametrize(
    ("options", "placement", "wrap"),
    [
        ("", ImageTransform(), "repeat"),
        ("-s 2 3 1 -o 0.25 0.5 0", ImageTransform(scale=(2, 3), translation=(0.25, 0.5)), "repeat"),
        ("-o 0.25 -s 2", ImageTransform(scale=(2, 1), translation=(0.25, 0)), "repeat"),
        ("-blendu on  -clamp on -mm 0 1 -bm 1", ImageTransform(), "clamp"),
        ("-clamp off -texres 512", ImageTransform(), "repeat"),
    ],
)
def test_options_place_the_image(tmp_path: Path, options: str, placement: ImageTransform, wrap: str) -> None:
    (tmp_path / "a  name with spaces.png").write_bytes(png(COLORED))
    asset = read_map(tmp_path, f"map_Kd {options} a  name with spaces.png")
    _, image = only(asset)
    assert (image.placement, image.wrap) == (placement, (wrap, wrap))
    assert any("edge goes on" in note for note in asset.notes) == (wrap == "clamp")


@pytest.mark.parametrize(
    ("statement", "found"),
    [
        ("map_Bump colored.png", "height map"),
        ("bump -bm 0.5 colored.png", "height map"),
        ("disp colored.png", "height map"),
        ("map_Ks colored.png", "no input"),
        ("refl -type sphere colored.png", "no input"),
        ("map_Kd -mm 0.5 1 colored.png", "-mm 0.5 1"),
        ("map_Kd -t 1 1 1 colored.png", "-t 1 1 1"),
        ("map_Kd -cc on colored.png", "-cc on"),
        ("map_d colored.png", "luminance"),
        ("map_d -imfchan l colored.png", "luminance"),
        ("map_Kd none.png", "missing"),
        ("map_Kd ../colored.png", "outside"),
        ("map_Kd /etc/hostname", "outside"),
        (r"map_Kd C:\wood.png", "outside"),
        ("map_Kd model.obj", "is not a PNG"),
    ],
)
def test_what_cannot_be_carried_over_is_noted_by_name(tmp_path: Path, statement: str, found: str) -> None:
    (tmp_path / "model").mkdir()
    (tmp_path / "colored.png").write_bytes(png(COLORED))
    asset = read_map(tmp_path / "model", statement)
    assert asset.materials[0].images == {}
    (note,) = asset.notes
    assert found in note
    assert "'paint'" in note
    assert statement.split()[0] in note


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "model").mkdir()
    (tmp_path / "secret.png").write_bytes(png(COLORED))
    (tmp_path / "model" / "wood.png").symlink_to(tmp_path / "secret.png")
    asset = read_map(tmp_path / "model", "map_Kd wood.png")
    assert asset.materials[0].images == {}
    assert "outside" in asset.notes[0]


def test_coordinates_of_one_or_three_numbers(tmp_path: Path) -> None:
    asset = read_map(tmp_path, "", MAPPED_OBJ.replace("vt 0.9 0.3", "vt 0.9 0.3 0.5").replace("vt 0.4 1.5", "vt 0.4"))
    assert asset.parts[0].primvars["st"].tolist() == [[0.1, 0.2], [0.9, 0.3], [0.8, 0.7], [0.4, 0]]


def test_coordinates_stay_with_their_faces_when_flat_ones_are_dropped(tmp_path: Path) -> None:
    asset = read_map(tmp_path, "", MAPPED_OBJ.replace("usemtl", "f 1/4 1/4 2/4\nusemtl"))
    assert asset.faces == 1
    assert asset.parts[0].primvars["st"].tolist() == [[0.1, 0.2], [0.9, 0.3], [0.8, 0.7], [0.4, 1.5]]


def test_a_black_factor_is_told(tmp_path: Path) -> None:
    assert "Ke, which is 0" in read_map(tmp_path, "Ke 0 0 0\nmap_Ke colored.png").notes[0]


def test_a_kd_of_zero_beside_a_map_is_ignored(tmp_path: Path) -> None:
    """CAD programs on Windows write it so; the format's product would be black."""
    asset = read_map(tmp_path, "Kd 0 0 0\nmap_Kd colored.png")
    assert only(asset)[1].scale == (1, 1, 1, 1)
    assert "Kd of 0 was ignored" in asset.notes[0]


def test_files_are_found_whatever_their_capitals(tmp_path: Path) -> None:
    (tmp_path / "Maps").mkdir()
    (tmp_path / "Maps" / "Wood.PNG").write_bytes(png(COLORED))
    name, image = only(read_map(tmp_path, r"map_Kd maps\wood.png"))
    assert (name, image.file.name) == ("diffuseColor", "Wood.png")
    assert "outside" in read_map(tmp_path, r"map_Kd maps\..\..\wood.png").notes[0]


def test_images_in_folders_below_with_windows_names(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "wood.png").write_bytes(png(COLORED))
    assert only(read_map(tmp_path, r"map_Kd maps\wood.png"))[1].file.name == "wood.png"


@pytest.mark.parametrize("suffix", ["bmp", "tga", "tif"])
def test_rarer_formats_become_png_without_loss(tmp_path: Path, suffix: str) -> None:
    Image.fromarray(COLORED.astype(np.uint8)).save(tmp_path / f"wood.{suffix}")
    file = only(read_map(tmp_path, f"map_Kd wood.{suffix}"))[1].file
    (tmp_path / "copy.png").write_bytes(file.data)
    assert file.name == "wood.png"
    assert np.array_equal(np.array(Image.open(tmp_path / "copy.png")), COLORED)


def test_a_gif_becomes_png(tmp_path: Path) -> None:
    Image.fromarray(GREY[..., 0].astype(np.uint8)).save(tmp_path / "wood.gif")
    file = only(read_map(tmp_path, "map_Kd wood.gif"))[1].file
    (tmp_path / "copy.png").write_bytes(file.data)
    assert np.array_equal(np.array(Image.open(tmp_path / "copy.png").convert("RGB")), GREY)


def test_faces_without_coordinates_keep_the_constants(tmp_path: Path) -> None:
    asset = read_map(tmp_path, "Kd 0.5 0.5 0.5\nmap_Kd colored.png", MAPPED_OBJ + "f 1 2 3\n")
    (part,) = asset.parts
    textured, plain = (asset.materials[index] for index in part.face_material)
    assert (bool(textured.images), bool(plain.images)) == (True, False)
    assert textured.constants == plain.constants
    assert any("1 faces of part 'model'" in note for note in asset.notes)


def test_a_coat_is_read_and_sheen_is_noted(tmp_path: Path) -> None:
    asset = read(tmp_path, "newmtl a\nPc 0.75\nPcr 0.1\nPs 0.5\naniso 0\nnewmtl b\nPs 0\n")
    coated, plain = (material.constants for material in asset.materials)
    assert (coated.clearcoat, coated.clearcoat_roughness) == (0.75, 0.1)
    assert plain.clearcoat == 0
    assert asset.notes == ("material 'a' of lib.mtl: its sheen (Ps 0.5) is left out: UsdPreviewSurface has none",)


@pytest.mark.parametrize(
    ("statement", "space"),
    [
        ("map_Kd -colorspace sRGB wood.png", "sRGB"),
        ("map_Kd -colorspace linear wood.png", "raw"),
        ("map_Pr -colorspace linear -imfchan r wood.png", "raw"),
    ],
)
def test_the_colour_space_of_an_option(tmp_path: Path, statement: str, space: str) -> None:
    (tmp_path / "wood.png").write_bytes(png(COLORED))
    asset = read_map(tmp_path, statement)
    assert only(asset)[1].color_space == space
    assert asset.notes == ()


@pytest.mark.parametrize(
    ("named", "file"),
    [
        (r"C:\art\RAL 9010.png", "RAL 9010.png"),
        (r"\\server\art\maps\wood.png", "maps/wood.png"),
        ("/home/me/maps/wood.png", "wood.png"),
    ],
)
def test_an_absolute_path_of_another_machine_finds_the_image_beside(tmp_path: Path, named: str, file: str) -> None:
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_bytes(png(COLORED))
    assert only(read_map(tmp_path, f"map_Kd {named}"))[0] == "diffuseColor"


@pytest.mark.parametrize(
    ("named", "file", "notes"),
    [
        (r"white\ one.mtl", "white one.mtl", 0),
        (r"none.mtl white\ one.mtl", "white one.mtl", 1),
        ("gone.mtl", "model.mtl", 2),
    ],
)
def test_libraries_with_blanks_and_of_the_models_name(tmp_path: Path, named: str, file: str, notes: int) -> None:
    asset = read(tmp_path, "newmtl a\nKd 1 0 0\nnewmtl b\n", named, file)
    assert asset.materials[0].constants.diffuse_color == (1, 0, 0)
    assert len(asset.notes) == notes
