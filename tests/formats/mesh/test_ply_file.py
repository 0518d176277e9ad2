"""PLY as its exporters write it. trimesh is the authority for what it reads."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from plyfile import PlyData, PlyElement

from spin_usd.errors import InputError
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.scene.asset import MeshAsset
from spin_usd.scene.derived import srgb
from spin_usd.scene.texture import Primvar
from tests.formats.mesh.conftest import png

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 2, 0)]
XYZ = [("x", "f4"), ("y", "f4"), ("z", "f4")]


def ply(path: Path, vertices: Any, faces: Any = (), *, text: bool = False, more: Any = (), **extra: Any) -> Path:
    """A file of `vertices` (a list of (name, type) and rows) and `faces`: lists of points."""
    elements = [PlyElement.describe(np.array(vertices[1], vertices[0]), "vertex")]
    if faces:
        rows = np.array([(face,) for face in faces], [("vertex_indices", object)])
        elements.append(PlyElement.describe(rows, "face", val_types={"vertex_indices": "i4"}))
    PlyData([*elements, *more], text=text, **extra).write(str(path))
    return path


def strips(path: Path, order: list[int]) -> Path:
    rows = np.array([(order,)], [("vertex_indices", object)])
    element = PlyElement.describe(rows, "tristrips", val_types={"vertex_indices": "i4"})
    return ply(path, (XYZ, POINTS), more=[element])


def colors_of(asset: MeshAsset) -> Any:
    (part,) = asset.parts
    assert asset.materials[part.face_material[0]].constants.diffuse_color == Primvar(name="displayColor")
    return part.primvars["displayColor"]


@pytest.mark.parametrize("text", [True, False])
def test_polygons_of_any_size_stay_whole(tmp_path: Path, text: bool) -> None:
    path = ply(tmp_path / "a.ply", (XYZ, POINTS), [[0, 1, 2, 3], [3, 2, 4], [0, 1, 2, 4, 3], [0, 1]], text=text)
    (part,) = read_mesh_file(path, 1).parts
    assert part.face_counts.tolist() == [4, 3, 5]
    assert part.face_indices.tolist() == [0, 1, 2, 3, 3, 2, 4, 0, 1, 2, 4, 3]


def test_a_strip_is_its_triangles_all_seen_from_one_side(tmp_path: Path) -> None:
    (part,) = read_mesh_file(strips(tmp_path / "a.ply", [0, 1, 3, 2, 4, -1, 0, 1, 2]), 1).parts
    corners = part.points[part.face_indices].reshape(-1, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert len(corners) == 4
    assert (normals[:, 2] > 0).all()


@pytest.mark.parametrize("prefix", ["", "diffuse_"])
def test_colours_of_points_are_shown_as_srgb(tmp_path: Path, prefix: str) -> None:
    kinds = [*XYZ, *((f"{prefix}{name}", "u1") for name in ("red", "green", "blue"))]
    rows = [(*point, 10 * i, 200, 255 - i) for i, point in enumerate(POINTS)]
    asset = read_mesh_file(ply(tmp_path / "a.ply", (kinds, rows), [[0, 1, 2]]), 1)
    expected = srgb.decode(np.array([[0, 200, 255], [10, 200, 254], [20, 200, 253]]) / 255)
    assert np.array_equal(colors_of(asset), expected)
    assert asset.notes == ("its colours are taken as sRGB",)


@pytest.mark.parametrize("largest", [1, 255])
def test_colours_of_faces_and_in_floats(tmp_path: Path, largest: int) -> None:
    kinds = [("vertex_indices", object), *((name, "f4") for name in ("red", "green", "blue"))]
    rows = np.array([([0, 1, 2], largest, 0, 0), ([0, 2, 3], 0, largest, 0)], kinds)
    faces = PlyElement.describe(rows, "face", val_types={"vertex_indices": "i4"})
    asset = read_mesh_file(ply(tmp_path / "a.ply", (XYZ, POINTS), more=[faces]), 1)
    assert np.array_equal(colors_of(asset), [[1, 0, 0]] * 3 + [[0, 1, 0]] * 3)


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_coordinates_and_the_texture_that_a_comment_names(tmp_path: Path, names: tuple[str, str]) -> None:
    kinds = [*XYZ, *((name, "f4") for name in names)]
    rows = [(*point, 0.125 * i, 0.5) for i, point in enumerate(POINTS)]
    (tmp_path / "wood.png").write_bytes(png(np.zeros((2, 2, 3))))
    path = ply(tmp_path / "a.ply", (kinds, rows), [[0, 1, 2]], comments=["TextureFile wood.png"])
    asset = read_mesh_file(path, 1)
    theirs = trimesh.load_mesh(path, process=False).visual.uv
    assert np.array_equal(asset.parts[0].primvars["st"], theirs[:3])
    image = asset.materials[asset.parts[0].face_material[0]].images["diffuseColor"]
    assert (image.file.name, image.primvar, image.color_space) == ("wood.png", "st", "sRGB")
    assert asset.notes == ()
    path = ply(tmp_path / "a.ply", (kinds, rows), [[0, 1, 2]])
    bare = read_mesh_file(path, 1)
    assert np.array_equal(bare.parts[0].primvars["st"], theirs[:3])
    assert "names no image" in bare.notes[0]


def test_coordinates_of_corners(tmp_path: Path) -> None:
    kinds = [("vertex_indices", object), ("texcoord", object)]
    rows = np.array([([0, 1, 2], [0, 0, 1, 0, 1, 1]), ([0, 2, 3], [0.5, 0, 1, 0, 1, 0.5])], kinds)
    faces = PlyElement.describe(rows, "face", val_types={"vertex_indices": "i4", "texcoord": "f4"})
    path = ply(tmp_path / "a.ply", (XYZ, POINTS), more=[faces], comments=["TextureFile none.png"])
    asset = read_mesh_file(path, 1)
    assert asset.parts[0].primvars["st"].tolist() == [[0, 0], [1, 0], [1, 1], [0.5, 0], [1, 0], [1, 0.5]]
    assert asset.notes == ("the texture 'none.png' is missing",)


def test_normals_are_the_files(tmp_path: Path) -> None:
    kinds = [*XYZ, ("nx", "f4"), ("ny", "f4"), ("nz", "f4")]
    path = ply(tmp_path / "a.ply", (kinds, [(*point, 0, i, 1) for i, point in enumerate(POINTS)]), [[2, 3, 0]])
    normals = read_mesh_file(path, 1).parts[0].normals
    assert normals is not None
    assert normals.tolist() == [[0, 2, 1], [0, 3, 1], [0, 0, 1]]


@pytest.mark.parametrize("text", [True, False])
def test_a_header_line_that_lacks_its_word_comment_is_one(tmp_path: Path, text: bool) -> None:
    """As Blender 2.47 wrote it."""
    path = ply(tmp_path / "a.ply", (XYZ, POINTS), [[0, 1, 2]], text=text, comments=["by Blender3D 247"])
    path.write_bytes(path.read_bytes().replace(b"comment by", b"Created by"))
    assert read_mesh_file(path, 1).faces == 1


def test_points_alone_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.ply: holds no faces"):
        read_mesh_file(ply(tmp_path / "a.ply", (XYZ, POINTS)), 1)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
def test_a_count_that_the_file_cannot_hold_is_refused_before_memory_is_taken(tmp_path: Path, kind: str) -> None:
    head = f"ply\nformat {kind} 1.0\nelement vertex 100000000000\n"
    (tmp_path / "a.ply").write_text(
        head + "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n0 0 0\n"
    )
    least = 10**11 * 3 * (2 if kind == "ascii" else 8)
    with pytest.raises(InputError, match=rf"a\.ply: counts points and faces of {least} bytes at least"):
        read_mesh_file(tmp_path / "a.ply", 1)


def test_text_of_the_fewest_digits_is_held_by_its_file(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
    faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_text(f"{head}{faces}0 0 0\n1 0 0\n0 1 0\n3 0 1 2")
    assert read_mesh_file(tmp_path / "a.ply", 1).faces == 1


@pytest.mark.parametrize("kind", ["u1", "u2", "i4", "u4"])
def test_colours_up_to_255_are_so_in_wider_numbers_too(tmp_path: Path, kind: str) -> None:
    """As files of laser scanners have them; to divide by all that the number holds would make them black."""
    kinds = [*XYZ, ("red", kind), ("green", kind), ("blue", kind)]
    path = ply(tmp_path / "a.ply", (kinds, [(*point, 255, 0, 51) for point in POINTS]), [[0, 1, 2]])
    encoded = srgb.encode(colors_of(read_mesh_file(path, 1)))
    assert np.allclose(encoded, [1, 0, 0.2], rtol=0, atol=1e-9)
