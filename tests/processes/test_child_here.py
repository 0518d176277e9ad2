"""SPIN_USD_IN_PROCESS=1: commands without child processes, for breakpoints and profilers, to the same bytes."""

import os
import subprocess
import sys

import pytest
from pxr import Sdf

import spin_usd
from spin_usd.processes.child import IN_PROCESS, Child, ChildHere
from spin_usd.processes.open_renderer import TRY_RENDERER

CODE = """
import sys, spin_usd
spin_usd.render(sys.argv[1], out=sys.argv[2], renderer="raycast", samples=1, frames="0:2", workers=1)
print(sorted({"pxr", "spin_usd.commands.render.worker"} & set(sys.modules)))
"""


def test_a_run_in_one_process_makes_the_same_bytes(small_stage, tmp_path) -> None:
    environment = {**os.environ, IN_PROCESS: "1"}
    command = [sys.executable, "-c", CODE, small_stage, tmp_path / "here"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['pxr', 'spin_usd.commands.render.worker']"
    spin_usd.render(small_stage, out=tmp_path / "usual", renderer="raycast", samples=1, frames="0:2")
    for kind in ("image", "depth", "dense_pose", "records"):
        usual = sorted((tmp_path / "usual" / kind).rglob("*.*"))
        here = [tmp_path / "here" / path.relative_to(tmp_path / "usual") for path in usual]
        assert [path.read_bytes() for path in here] == [path.read_bytes() for path in usual]
        assert usual


def test_a_layer_that_is_held_is_read_again_where_its_file_has_changed(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv(IN_PROCESS, "1")
    file = tmp_path / "stage.usda"
    file.write_text('#usda 1.0\ndef Xform "Before" {}\n')
    held = Sdf.Layer.FindOrOpen(str(file))
    file.write_text('#usda 1.0\ndef Xform "After" {}\n')
    with Child():
        assert [prim.name for prim in held.rootPrims] == ["After"]
    file.unlink()
    with Child():
        assert [prim.name for prim in held.rootPrims] == ["After"]


def test_faults_and_progress_come_as_from_a_process(monkeypatch) -> None:
    monkeypatch.setenv(IN_PROCESS, "1")
    with Child() as child:
        assert isinstance(child, ChildHere)
        with pytest.raises(spin_usd.SpinError, match="there is no renderer 'none'"):
            child.call(TRY_RENDERER, "none")
