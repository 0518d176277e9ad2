"""An encoded image of which anything was lost is told from a whole one, without being decoded."""

import subprocess
import sys

import numpy as np
import pytest

from spin_usd.formats.image_file import exr_is_whole, png_is_whole, write_image

ROWS = 70
LOST = (1, 7, 64, 512, 4096)
RENDERED = np.random.default_rng(0).integers(0, 2**16, (ROWS, 90))


def encoded(folder, name):
    path = folder / name
    write_image(path, RENDERED.astype(np.float32 if name == "a.exr" else np.uint16), channels=("Y",))
    return path.read_bytes()


def whole(name, data):
    return png_is_whole(data) if name == "a.png" else exr_is_whole(data, rows=ROWS)


@pytest.mark.parametrize("name", ["a.exr", "a.png"])
def test_what_is_cut_or_lacks_a_piece_is_not_whole(tmp_path, name) -> None:
    data = encoded(tmp_path, name)
    assert whole(name, data)
    assert not any(whole(name, data[:end]) for end in range(0, len(data), 13))
    assert not whole(name, data + b"\0")
    for lost in LOST:
        assert not any(whole(name, data[:start] + data[start + lost :]) for start in range(0, len(data) - lost, 97))


@pytest.mark.parametrize("name", ["a.exr", "a.png"])
def test_no_limit_of_a_files_size_leaves_half_an_image(tmp_path, name) -> None:
    """OpenImageIO reports success at some of these limits."""
    size = len(encoded(tmp_path, name))
    code = (
        "import resource, sys; from pathlib import Path; from spin_usd.errors import OutputError\n"
        "from tests.formats.test_whole_image import RENDERED, encoded\n"
        "folder, name, size = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])\n"
        "whole = encoded(folder, name)\n"
        "said = 0\n"
        "for limit in (*range(0, size, 499), size - 1, size, size + 1):\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))\n"
        "    try: assert encoded(folder, name) == whole and limit >= size, limit\n"
        "    except OutputError: said += 1\n"
        "    else: continue\n"
        "    assert limit < size\n"
        "print(said)\n"
    )
    command = [sys.executable, "-c", code, str(tmp_path), name, str(size)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert int(done.stdout or 0) >= size // 499, done
