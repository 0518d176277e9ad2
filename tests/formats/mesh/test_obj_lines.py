"""OBJ by lines: a backslash continues one, at no more cost than a line; one without end is refused; what names and
smoothing groups mean."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.geometry.triangles import unit_vectors

POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def test_continued_lines_are_one(tmp_path: Path) -> None:
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 1 0 \\\n0\nv 0 1 0\nf 1 \\\n2 \\\n3\n")
    (part,) = read_mesh_file(tmp_path / "b.obj", 1).parts
    assert part.face_indices.tolist() == [0, 1, 2]


def test_many_continued_lines_end(tmp_path: Path) -> None:
    """Each was joined to all before it: a file of 1.2 MB took 22 s, and this one would take an hour."""
    corners = " \\\n".join(["1 2 3"] * 200_000)
    (tmp_path / "a.obj").write_text(f"{POINTS}f {corners}\nf 1 2 3\n")
    (part,) = read_mesh_file(tmp_path / "a.obj", 1).parts
    assert np.array_equal(part.points.max(0), [1, 1, 0])


@pytest.mark.parametrize(
    ("face", "saying"),
    [
        ("1 " * 2**23, r"line 4: has 16777218 characters, more than 16777216; look for line breaks"),
        (("1 " * 2**20 + "\\\n") * 9, r"continues for more than 16777216 characters; look for backslashes"),
    ],
)
def test_a_line_without_end_is_refused(tmp_path: Path, face: str, saying: str) -> None:
    (tmp_path / "a.obj").write_text(f"{POINTS}f {face}")
    with pytest.raises(InputError, match=saying):
        read_mesh_file(tmp_path / "a.obj", 1)


def test_a_hash_begins_a_comment_where_no_name_stands(tmp_path: Path) -> None:
    (tmp_path / "m#1.mtl").write_text("# a\nnewmtl foil#1\nKd 1 0 0 # red\nnewmtl foil#2\nKd 0 1 0\n")
    body = "o Panel#{0}\nusemtl foil#{0}\nf 1 2 3 # a face\n"
    (tmp_path / "a.obj").write_text(f"mtllib m#1.mtl\n # b\n{POINTS}{body.format(1)}{body.format(2)}")
    asset = read_mesh_file(tmp_path / "a.obj", 1)
    assert [part.name for part in asset.parts] == ["Panel#1", "Panel#2"]
    assert [each.constants.diffuse_color for each in asset.materials] == [(1, 0, 0), (0, 1, 0)]


def test_a_group_names_a_part_where_it_divides_an_object(tmp_path: Path) -> None:
    body = "o Body\ng Body_FOIL\nf 1 2 3\no Wing\ng Left\nf 1 2 3\ng Right\nf 1 2 3\ng Alone\n"
    (tmp_path / "a.obj").write_text(f"{POINTS}{body}")
    assert [part.name for part in read_mesh_file(tmp_path / "a.obj", 1).parts] == ["Body", "Wing Left", "Wing Right"]


BLENDERS = """
import bpy, sys
import numpy as np
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.obj_import(filepath=sys.argv[1], forward_axis="Y", up_axis="Z")
mesh = bpy.context.selected_objects[0].data
np.save(sys.argv[2], [[each.vector[:] for each in mesh.corner_normals], [mesh.vertices[each.vertex_index].co[:]
                                                                       for each in mesh.loops]])
"""


def test_smoothing_groups_are_smooth_as_blender_has_them(tmp_path: Path, shared: Path) -> None:
    """A drum: its wall is smooth, its ends are flat."""
    file = shared / "data" / "strangers" / "smoothing_groups.obj"
    subprocess.run([sys.executable, "-c", BLENDERS, file, tmp_path / "n.npy"], check=True, stdout=subprocess.DEVNULL)
    normals, points = np.load(tmp_path / "n.npy")
    (part,) = read_mesh_file(file, 1).parts
    assert np.allclose(part.points[part.face_indices], points, atol=1e-6)
    assert part.normals is not None
    np.testing.assert_allclose(unit_vectors(part.normals), normals, atol=2e-3)  # Blender keeps 16 bits of each


def test_other_smoothing_groups_meet_in_an_edge(tmp_path: Path) -> None:
    roof = "v 0 0 0\nv 0 1 0\nv 1 0 -1\nv 1 1 -1\nv -1 0 -1\nv -1 1 -1\n"
    for second, up in ((1, True), (2, False)):
        (tmp_path / "a.obj").write_text(f"{roof}s 1\nf 1 3 4 2\ns {second}\nf 1 2 6 5\n")
        (part,) = read_mesh_file(tmp_path / "a.obj", 1).parts
        assert part.normals is not None
        ridge = unit_vectors(part.normals)[part.face_indices < 2]
        assert np.allclose(ridge, [0, 0, 1]) == up
