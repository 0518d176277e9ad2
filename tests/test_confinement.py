"""Where children may write: the kernel refuses all folders but a few, of which each kind of child has its own.

Before its first call each child gets another one: to write into other folders.
"""

import ast
import shutil
from pathlib import Path

import pytest

from spin_usd import Simulator
from spin_usd.commands.keypoints.options import KeypointsOptions
from spin_usd.commands.keypoints.run import open_session
from spin_usd.commands.watch.state import viewer
from spin_usd.processes.call import Call
from spin_usd.processes.child import HAND_ON, Child
from spin_usd.processes.confine import landlock_version
from spin_usd.processes.executor import Executor
from spin_usd.scene.effort import Effort
from tests.conftest import EXAMPLE_POSES
from tests.test_architecture import MODULES, tree

pytestmark = [
    pytest.mark.children,
    pytest.mark.skipif(landlock_version() < 3, reason="the kernel has no Landlock of version 3"),
]

PROBE = """
import os
import tempfile

def writable(folders: list[str]) -> list[str]:
    return [folder for folder in (*folders, tempfile.gettempdir()) if can_write(folder)]

def can_write(folder):
    try:
        os.close(os.open(folder + "/probe", os.O_CREAT | os.O_WRONLY))
        os.remove(folder + "/probe")
        return True
    except PermissionError:
        return False
"""
WRITABLE = Call("probe:writable", list[str], list[str])


@pytest.fixture
def probed(tmp_path, small_stage, rendered, monkeypatch):
    """The folders of `places` in which each child of this test could write; its temporary folder is left out."""
    places = {name: tmp_path / name for name in ("outside", "stage", "dataset", "out")}
    for name, copied in (("stage", small_stage.parent), ("dataset", rendered)):
        shutil.copytree(copied, places[name])
    for folder in ("outside", "out", "modules"):
        (tmp_path / folder).mkdir()
    (tmp_path / "modules" / "probe.py").write_text(PROBE)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "modules"))
    monkeypatch.setenv(HAND_ON, "PYTHONPATH")
    monkeypatch.chdir(tmp_path)
    could: list[set[str]] = []
    asked, send = set[Child](), Child.send

    def probing(child, call, request) -> None:
        if child not in asked:
            asked.add(child)
            send(child, WRITABLE, [str(tmp_path), *map(str, places.values())])
            *found, own = child.receive(within_s=60.0)["result"]
            assert own not in found
            threads = Path(f"/proc/{child.process.pid}/task").glob("*/status")
            assert all("NoNewPrivs:\t1" in each.read_text() for each in threads)  # all began after it was confined
            could.append({Path(each).name for each in found})
        send(child, call, request)

    monkeypatch.setattr(Child, "send", probing)
    return could


RAYCAST = ("--renderer", "raycast", "--frames", "0:1")
FRAME = ("--poses", EXAMPLE_POSES, "--target", "cubesat", "--camera", "speedplus", "--frames", "0:1")
SPECIFICATION = """schema = "augment-1"
[[augmentation]]
name = "gain"
[augmentation.sample]
"sun.factor" = { distribution = "uniform", low = 0.5, high = 2, per = "frame" }
"""
COMMANDS = {
    "author": ((*FRAME, "--out", "out/stage"), {"out"}),
    "augment": (("stage", "--spec", "spec.toml"), {"stage"}),
    "check": (("stage",), set()),
    "check --quiet": (("dataset",), set()),
    "plan": (("stage", "--frames", "0:1"), set()),
    "diff": (("stage", "nominal", "nominal"), set()),
    "render": (("stage", *RAYCAST, "--out", "out"), {"out"}),
    "show": (("dataset", "--out", "out"), {"out"}),
    "export": (("dataset", "--to", "speedplus", "--out", "out"), {"out", "dataset"}),
    "export --copy": (("dataset", "--to", "speedplus", "--out", "out"), {"out"}),
    "debug --samples 1": (("stage", "--frame", "0", "--out", "out/scene.blend"), set()),
    "reproduce": (("dataset", "img000001"), set()),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_children_of_a_command_write_in_its_folders_alone(command, probed, spin_usd) -> None:
    arguments, expected = COMMANDS[command]
    Path("spec.toml").write_text(SPECIFICATION)
    name, *options = command.split()
    spin_usd(name, *arguments, *options)
    assert probed
    assert set().union(*probed) == expected


def test_children_that_last_write_a_log_at_most(probed) -> None:
    target = str(next(Path("stage").rglob("cubesat*.usd*")))
    with Simulator("stage", renderer="raycast") as simulator:
        simulator.picture("img000001")
    assert probed.pop() == set()
    with Simulator("stage", renderer="raycast", log="out") as simulator:
        simulator.picture("img000001")
    assert probed.pop() == {"out"}
    viewer("raycast", Effort(samples=1)).close()
    with Executor[None]() as child:
        open_session(KeypointsOptions(target=target, out=Path("out/points.usda")), child, lambda line: None)
    assert probed == [set()] * 3


def test_nothing_else_is_without_a_limit() -> None:
    """Drivers of graphics processors write where they want; a worker of another machine gets its folders later."""
    found = {
        module.as_posix()
        for module in MODULES
        for node in ast.walk(tree(module))
        if isinstance(node, ast.keyword) and node.arg == "writes" and ast.unparse(node.value) == "None"
    }
    assert found == {"processes/devices.py", "processes/cluster/worker_actor.py"}
