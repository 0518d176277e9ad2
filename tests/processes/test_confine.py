"""What a confined process may read: plain files below one folder, and nothing else of a user's."""

import os
import subprocess
import sys

import pytest

from spin_usd.commands.doctor import run
from spin_usd.processes import confine

READ = """
import os, sys
from spin_usd.processes import confine
confine.MAX_FILES = int(sys.argv[2])
if not confine.confine(sys.argv[1]):
    sys.exit("no Landlock")
for path in sys.argv[3:]:
    try:
        os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK))
        print("read")
    except PermissionError:
        print("refused")
import bpy
"""


@pytest.mark.parametrize("most", [confine.MAX_FILES, 1])
def test_plain_files_of_one_folder_are_read_and_nothing_else(tmp_path, most) -> None:
    """Where there are very many, pipes among them are not told apart."""
    inside, outside = tmp_path / "in", tmp_path / "out"
    (tmp_path / "own").mkdir()
    for place in (inside / "deep", outside):
        place.mkdir(parents=True)
        (place / "a.png").touch()
    (inside / "link.png").symlink_to(outside / "a.png")
    os.mkfifo(inside / "pipe")
    paths = [inside / "deep" / "a.png", outside / "a.png", inside / "link.png", inside / "pipe", "/dev/zero"]
    environment = os.environ | {"TMPDIR": str(tmp_path / "own")}
    command = [sys.executable, "-c", READ, inside, str(most), *paths]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if "no Landlock" in done.stderr:
        pytest.skip("the kernel has no Landlock")
    expected = ["read", "refused", "refused", "refused" if most > 1 else "read", "refused"]
    assert done.stdout.split()[:5] == expected, done.stderr
    assert done.returncode == 0, done.stderr


def test_doctor_says_whether_a_process_can_be_confined(tmp_path) -> None:
    code = "import sys; from spin_usd.processes import confine; print(confine.confine(sys.argv[1]))"
    done = subprocess.run([sys.executable, "-c", code, tmp_path], capture_output=True, text=True, check=True)
    assert (confine.landlock_version() > 0) is (done.stdout.strip() == "True")


@pytest.mark.parametrize(("version", "saying"), [(0, "no Landlock in this kernel"), (4, "Landlock 4: ")])
def test_doctor_is_well_without(monkeypatch, version, saying) -> None:
    monkeypatch.setattr(run, "landlock_version", lambda: version)
    line = run._confinement()
    assert line.well
    assert line.found.startswith(saying)


WRITE = """
import os, sys
from spin_usd.processes import confine
if not confine.confine_writing(sys.argv[1:2]):
    sys.exit("no Landlock")
def tried(what):
    try:
        what()
        print("done")
    except PermissionError:
        print("refused")
inside, outside = sys.argv[1:]
for place in (inside, outside, os.environ["TMPDIR"]):
    tried(lambda: open(place + "/new", "w").write("x"))
tried(lambda: open(outside + "/old", "a"))
tried(lambda: os.truncate(outside + "/old", 0))
tried(lambda: os.remove(outside + "/old"))
tried(lambda: os.mkdir(outside + "/folder"))
os.mkdir(inside + "/a")
tried(lambda: os.replace(inside + "/new", inside + "/a/new"))
print(open(outside + "/old").read())
"""


def test_files_are_written_in_one_folder_and_nowhere_else(tmp_path) -> None:
    for name in ("in", "out", "own"):
        (tmp_path / name).mkdir()
    (tmp_path / "out" / "old").write_text("kept")
    command = [sys.executable, "-c", WRITE, tmp_path / "in", tmp_path / "out"]
    environment = os.environ | {"TMPDIR": str(tmp_path / "own")}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if "no Landlock" in done.stderr:
        pytest.skip("the kernel has no Landlock of version 3")
    assert done.stdout.split() == ["done", "refused", "done", *["refused"] * 4, "done", "kept"], done.stderr
