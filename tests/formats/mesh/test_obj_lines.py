"""OBJ by lines: a backslash continues one, at no more cost than a line; one without end is refused."""

from pathlib import Path

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.formats.mesh.mesh_file import read_mesh_file

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
