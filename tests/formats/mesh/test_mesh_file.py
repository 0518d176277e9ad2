"""Mesh files: parts, polygons, normals, materials and units. trimesh is the authority for OBJ."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.formats.mesh.mesh_file import read_mesh_file, without_doubles
from spin_usd.scene.asset import MeshPart

DOUBLE = 1e-15  # relative; a division or a sum
CUBE = """
v 0 0 0
v 100 0 0
v 100 100 0
v 0 100 0
v 0 0 100.123456789
vt 0.25 0.75
vn 0 0 2
vn 0 0 0
g front
usemtl gold
f 1//1 2//1 3//1 4//1
g Ümläut side
usemtl (silver)
f -5/1 -4 -1
usemtl gold
f 1 5 4
"""


def write(tmp_path: Path, text: str, name: str = "model.obj") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def triangles(part: MeshPart) -> Float:
    """(T, 3, 3) corners; the part's faces are triangles."""
    return part.points[part.face_indices].reshape(-1, 3, 3)


def in_any_order(corners: Float) -> Float:
    return corners.reshape(-1, 9)[np.lexsort(corners.reshape(-1, 9).T)]


def test_an_obj_keeps_polygons_groups_normals_and_materials(tmp_path: Path) -> None:
    asset = read_mesh_file(write(tmp_path, CUBE), 100)
    front, side = asset.parts
    assert (front.name, side.name) == ("front", "Ümläut side")
    assert (front.face_counts.tolist(), side.face_counts.tolist()) == ([4], [3, 3])
    assert [material.constants.path for material in asset.materials] == ["gold", "(silver)"]
    assert (front.face_material.tolist(), side.face_material.tolist()) == ([0], [1, 0])
    assert front.normals is not None
    assert side.normals is None
    assert side.points.max() == pytest.approx(1.00123456789, rel=DOUBLE)
    assert any("no definition" in note for note in asset.notes)


def test_the_real_tango_has_its_35_groups_and_trimeshs_triangles(shared: Path) -> None:
    path = shared / "data" / "tango" / "tango.obj"
    asset = read_mesh_file(path, 100)
    authority = trimesh.load_scene(path, process=False, split_groups=True, split_objects=True)
    assert len(asset.parts) == 35
    assert asset.faces == 23360
    for part in asset.parts:
        theirs = in_any_order(authority.geometry[part.name].triangles / 100)
        assert np.array_equal(in_any_order(triangles(part)), theirs)


def test_material_libraries_give_constants(tmp_path: Path) -> None:
    (tmp_path / "lib.mtl").write_text(
        "newmtl gold\nKd 0.8 0.6 0.1\nNs 98\nKs 0.5 0.5 0.5\nmap_Kd gold.png\n"
        "newmtl (silver)\nKd 1 1 1\nPm 1\nPr 0.25\n"
    )
    asset = read_mesh_file(write(tmp_path, "mtllib lib.mtl\n" + CUBE), 1)
    gold, silver = (material.constants for material in asset.materials)
    assert gold.diffuse_color == (0.8, 0.6, 0.1)
    assert gold.ior == pytest.approx(1.5)  # an exporter's default Ks of 0.5 is 4 %, glass
    assert np.power(gold.roughness, 4) == pytest.approx(2 / 100)
    assert (silver.metallic, silver.roughness) == (1, 0.25)
    assert any("map_Kd gold.png is not carried over" in note and "missing" in note for note in asset.notes)


@pytest.mark.parametrize("library", ["missing.mtl", "../lib.mtl", "/etc/hostname"])
def test_a_library_that_is_not_beside_the_model_is_noted(tmp_path: Path, library: str) -> None:
    asset = read_mesh_file(write(tmp_path, f"mtllib {library}\n{CUBE}"), 1)
    assert any(library in note for note in asset.notes)


@pytest.mark.parametrize("suffix", ["ply", "stl"])
def test_ply_and_stl_round_trip(tmp_path: Path, suffix: str) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=1)
    mesh.export(tmp_path / f"ball.{suffix}")
    asset = read_mesh_file(tmp_path / f"ball.{suffix}", 1)
    assert [part.name for part in asset.parts] == ["ball"]
    float32 = in_any_order(np.float32(mesh.triangles))  # what both formats keep
    assert np.allclose(in_any_order(np.float32(triangles(asset.parts[0]))), float32, atol=1e-7)


def test_gltf_applies_node_transforms_and_reads_factors_exactly(tmp_path: Path) -> None:
    box = trimesh.creation.box()
    gold = trimesh.visual.material.PBRMaterial(name="gold", baseColorFactor=[204, 153, 51, 255], metallicFactor=0.9)
    box.visual = trimesh.visual.TextureVisuals(material=gold)
    scene = trimesh.Scene()
    turn = trimesh.transformations.compose_matrix(angles=(0.3, 0.2, 0.1), translate=(1, 2, 3))
    mirror = np.diag([-1.0, 1, 1, 1])
    scene.add_geometry(box, node_name="bus", geom_name="bus", transform=turn)
    scene.add_geometry(trimesh.creation.icosphere(subdivisions=0), node_name="ball", geom_name="ball", transform=mirror)
    scene.export(tmp_path / "model.glb")
    asset = read_mesh_file(tmp_path / "model.glb")
    bus, ball = asset.parts
    assert (bus.name, ball.name) == ("bus", "ball")
    assert np.allclose(bus.points.mean(0), (1, 2, 3), atol=1e-6)  # the file's points are float32
    corners = triangles(ball)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((outward * corners.mean(1)).sum(1) > 0).all()  # mirrored, and still seen from outside
    assert asset.materials[0].constants.metallic == 0.9
    assert asset.materials[0].constants.diffuse_color == (0.8, 0.6, 0.2)
    assert (bus.face_material == 0).all()
    assert (ball.face_material == -1).all()


def test_dark_gltf_colours_are_not_rounded_to_eight_bits(tmp_path: Path) -> None:
    trimesh.Scene(trimesh.creation.box()).export(tmp_path / "a.gltf")
    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(trimesh.creation.box()))
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    document = json.loads((tmp_path / "model.gltf").read_text())
    document["materials"] = [{"name": "dark", "pbrMetallicRoughness": {"baseColorFactor": [0.0123, 0.02, 0.03, 1]}}]
    document["meshes"][0]["primitives"][0]["material"] = 0
    (tmp_path / "model.gltf").write_text(json.dumps(document))
    asset = read_mesh_file(tmp_path / "model.gltf")
    assert asset.materials[0].constants.diffuse_color == (0.0123, 0.02, 0.03)
    assert asset.materials[0].constants.metallic == 1  # the standard's own fallback


def test_faces_without_area_are_dropped_with_a_note(tmp_path: Path) -> None:
    asset = read_mesh_file(write(tmp_path, CUBE + "f 1 1 2\nf 1 2 2\n"), 100)
    assert asset.faces == 3
    assert any("2 of 5" in note for note in asset.notes)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", r"line 4.*point '4' of 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", r"line 4.*point '0'"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", r"line 3.*2 corners"),
        ("v 0 0 0\nv 1 x 0\n", r"line 2.*three numbers"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf a b c\n", r"line 4.*corner"),
        ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", r"NaN"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", r"no faces"),
        ("", r"no faces"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", r"zero area"),
        ("\0\0", r"not a text file"),
    ],
)
def test_bad_objs_are_refused_in_one_sentence(tmp_path: Path, text: str, found: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=found) as caught:
        read_mesh_file(path, 1)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("suffix", ["ply", "stl", "glb", "gltf"])
@pytest.mark.parametrize("data", [b"", b"nonsense", b"ply\nformat ascii 1.0\nend_header\n", b"glTF\2\0\0\0"])
def test_damaged_files_are_refused(tmp_path: Path, suffix: str, data: bytes) -> None:
    path = tmp_path / f"model.{suffix}"
    path.write_bytes(data)
    with pytest.raises(InputError, match=f"model.{suffix}"):
        read_mesh_file(path, 1)


def test_a_ply_with_indices_out_of_range_is_refused(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
    path = write(
        tmp_path, head + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 7\n", "a.ply"
    )
    with pytest.raises(InputError, match="point 7"):
        read_mesh_file(path, 1)


@pytest.mark.parametrize("units", [0, -1, float("nan"), float("inf")])
def test_units_that_are_none_are_refused(tmp_path: Path, units: float) -> None:
    with pytest.raises(InputError, match="units per metre"):
        read_mesh_file(write(tmp_path, CUBE), units)


def test_units_are_asked_for_and_never_guessed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--units-per-metre, for example 100"):
        read_mesh_file(write(tmp_path, CUBE))


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not one of the mesh formats"):
        read_mesh_file(write(tmp_path, CUBE, "model.step"), 1)
    with pytest.raises(InputError, match="not there"):
        read_mesh_file(tmp_path / "none.obj", 1)


@pytest.mark.parametrize("ending", ["obj", "glb"])
def test_normals_against_their_faces_are_turned(shared: Path, ending: str) -> None:
    """Else Cycles shows black what others show lit."""
    asset = read_mesh_file(shared / "data" / "strangers" / f"normals_against_winding.{ending}", 1)
    for part in asset.parts:
        assert part.normals is not None
        mean = np.add.reduceat(part.normals, part.face_starts)
        assert (np.einsum("ij,ij->i", mean, part.areas[0]) > 0).all()
    assert any("normals on 100 % of the area contradict their faces' winding" in note for note in asset.notes)


def test_normals_that_agree_stay_as_they_are(tmp_path: Path) -> None:
    """Smooth ones too, though some lean over the edge of a face."""
    ball = trimesh.creation.icosphere(subdivisions=1)
    ball.vertex_normals  # noqa: B018 - written where they are there
    (tmp_path / "ball.obj").write_text(trimesh.exchange.obj.export_obj(ball, include_normals=True))
    asset = read_mesh_file(tmp_path / "ball.obj", 1)
    (part,) = asset.parts
    assert not asset.notes
    np.testing.assert_allclose(part.normals, ball.vertex_normals[ball.faces].reshape(-1, 3), atol=1e-6)


@pytest.mark.parametrize(("name", "kept"), [("coincident_quad.obj", 1), ("coincident_tris.obj", 2)])
def test_of_faces_with_the_same_corners_the_first_is_kept(shared: Path, name: str, kept: int) -> None:
    asset = without_doubles(read_mesh_file(shared / "data" / "strangers" / name, 1))
    assert asset.faces == kept
    assert any("have the corners of another: one of each two is kept" in note for note in asset.notes)


def test_faces_that_share_all_but_a_corner_stay(tmp_path: Path) -> None:
    """Those of a grid, and of its reflection at the origin."""
    x, y = np.meshgrid(np.arange(-20.0, 20), np.arange(-20.0, 20))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    corner = np.arange(39 * 40).reshape(39, 40)[:, :-1].ravel()
    faces = np.concatenate([corner[:, None] + [0, 1, 40], corner[:, None] + [1, 41, 40]])
    trimesh.Trimesh(points, faces, process=False).export(tmp_path / "grid.obj")
    assert without_doubles(read_mesh_file(tmp_path / "grid.obj", 1)).faces == len(faces)


@pytest.mark.parametrize(
    ("rows", "corners", "normals", "mapped"),
    [
        ("", "1/1/1 2/2/2 3/3/3", False, False),
        ("vt 0 0\nvt 1 0\n", "1/1/-1 2/2/-1 3/-3/-1", False, True),
        ("vn 0 0 1\n", "1//1 2//1 3//7", False, False),
        ("", "1//1 2//1 3//1\nvn 0 0 1", True, False),
    ],
)
def test_indices_of_normals_that_are_not_there_are_read_without_them(
    tmp_path: Path, rows: str, corners: str, normals: bool, mapped: bool
) -> None:
    """As Blender and trimesh do; a normal that comes after its face is there."""
    asset = read_mesh_file(write(tmp_path, f"v 0 0 0\nv 1 0 0\nv 0 1 0\n{rows}f {corners}\n"), 1)
    (part,) = asset.parts
    assert (part.normals is not None, "st" in part.primvars) == (normals, mapped)
    assert any("that the file does not have" in note for note in asset.notes) != normals
