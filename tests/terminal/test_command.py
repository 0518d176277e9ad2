"""How commands understand what they are given."""

import subprocess
import sys

import pytest

LOADED = """
import sys
sys.argv[1:] = {words}
from spin_usd.command_line import run
try:
    run()
except SystemExit:
    print("pydantic" in sys.modules)
"""


@pytest.mark.parametrize(
    ("words", "loaded"),
    [
        (["render", "nowhere", "--out", "here", "--labels-only", "--frames", "0:1"], False),
        (["check", "nowhere"], False),
        (["export", "nowhere", "--to", "coco", "--out", "here"], False),
        (["merge", "nowhere", "neither", "--out", "here"], True),  # a list of paths
        (["render", "nowhere", "--out", "here", "--workers", "1"], True),
    ],
)
def test_texts_and_paths_are_understood_without_pydantic(words, loaded, tmp_path) -> None:
    """It takes a tenth of a second to load; numbers and lists need it."""
    command = [sys.executable, "-c", LOADED.format(words=words)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert "nowhere" in done.stderr
    assert done.stdout.splitlines()[-1] == str(loaded)
