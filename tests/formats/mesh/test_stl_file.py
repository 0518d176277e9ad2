"""STL of text and of bytes: what is damaged is one sentence, and costs no more than a look."""

import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

from spin_usd.errors import InputError
from spin_usd.formats.mesh.mesh_file import read_mesh_file

FACET = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
HUGE = b"a" * 10**8


def written(folder: Path, text: str | bytes, suffix: str = ".stl") -> Path:
    path = folder / f"model{suffix}"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_a_damaged_normal_is_no_loss_and_prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """trimesh logs a traceback of it; the normals of an STL are those of its faces anyway."""
    path = written(tmp_path, f"solid a\n{FACET.replace('0 0 1', 'x 0 1')}endsolid a\n")
    (part,) = read_mesh_file(path, 1).parts
    assert np.array_equal(part.points, [(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    assert part.normals is None
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (f"solid a\n{FACET}{FACET.replace('1 0 0', '1 x 0')}endsolid a\n", "is damaged"),
        (f"solid a\n{FACET.replace('1 0 0', '1 0')}endsolid a\n", "is damaged"),
        (f"solid a\n{FACET}", "no faces"),
        (b"\0" * 80 + b"\x02\0\0\0" + b"\0" * 50, "has 134 bytes, and its head counts 2 faces, for which it takes 184"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, text: str | bytes, found: str) -> None:
    with pytest.raises(InputError, match=rf"model\.stl: .*{found}"):
        read_mesh_file(written(tmp_path, text), 1)


def test_a_binary_file_that_calls_itself_solid_is_read(tmp_path: Path) -> None:
    data = bytearray(trimesh.creation.box((1, 2, 3)).export(file_type="stl"))
    data[:5] = b"solid"
    assert read_mesh_file(written(tmp_path, bytes(data)), 1).faces == 12


@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        (".stl", b"solid " + HUGE + b"\n" + FACET.encode() + b"endsolid\n"),
        (".stl", b"solid a\n" + FACET.encode() + b"facet " + HUGE + b"\nendsolid\n"),
        (".ply", b"ply\nformat ascii 1.0\ncomment " + HUGE + b"\nend_header\n"),
        (".ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n" + HUGE + b"\n"),
    ],
)
def test_endless_lines_are_refused_before_they_are_parsed(tmp_path: Path, suffix: str, text: bytes) -> None:
    path = written(tmp_path, text, suffix)
    begun = time.process_time()
    with pytest.raises(InputError, match=r"line of more than|no end_header"):
        read_mesh_file(path, 1)
    assert time.process_time() - begun < 1
