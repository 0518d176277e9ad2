"""Renders on a real Ray cluster: a head and nodes on this machine, which come and go."""

import os
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import pytest

from spin_usd.files.sha256 import sha256_of

pytestmark = [pytest.mark.slow, pytest.mark.children, pytest.mark.timeout(900)]
OPTIONS = ("--renderer", "raycast", "--labels", "default,normals_cam")


class RayNodes:
    """The cluster that ray_nodes.py holds."""

    def __init__(self, python, folder):
        """`folder`: of temporary files on all nodes."""
        program = Path(__file__).parent / "ray_nodes.py"
        self.folder, self._log = folder, folder / "log"
        with self._log.open("w") as said:
            self._process = subprocess.Popen(
                [python, program],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=said,
                text=True,
                env={**os.environ, "TMPDIR": str(folder)},
            )
        self.address = self._answer()

    def say(self, *words):
        """Say these words to it; returns its answer."""
        with suppress(BrokenPipeError):  # it has ended, and so have its answers
            print(*words, file=self._process.stdin, flush=True)
        return self._answer()

    def end(self):
        with suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait()

    def _answer(self):
        answer = self._process.stdout.readline().strip()
        assert answer, f"Ray's cluster ended, {self._process.wait()}:\n{self._log.read_text(errors='replace')}"
        return answer


@pytest.fixture(scope="module")
def nodes(python, tmp_path_factory):
    """A head, and two nodes of one processor each."""
    nodes = RayNodes(python, tmp_path_factory.mktemp("ray"))
    try:
        assert [nodes.say("add"), nodes.say("add")] == ["0", "1"]
        yield nodes
    finally:
        nodes.end()


@pytest.fixture(scope="module")
def here(small_stage, tmp_path_factory, spin_usd):
    """The digests of the stage's dataset made by workers of this machine."""
    out = tmp_path_factory.mktemp("here") / "dataset"
    spin_usd("render", small_stage, "--out", out, *OPTIONS)
    return digests(out)


def digests(dataset):
    """The sha256 by name of all files that a reader of the dataset sees."""
    files = (file for file in dataset.rglob("*") if file.is_file() and "cache" not in file.relative_to(dataset).parts)
    return {str(file.relative_to(dataset)): sha256_of(file) for file in files}


def started(python, stage, out, address, *more):
    command = [
        python,
        "-m",
        "spin_usd.command_line",
        "render",
        stage,
        "--out",
        out,
        *OPTIONS,
        "--cluster",
        address,
        *more,
    ]
    return subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def ended(process):
    said, warned = process.communicate()
    assert process.returncode == 0, f"{said}\n{warned}"
    return said


def test_a_node_that_dies_and_one_that_comes_late_change_no_byte(python, nodes, small_stage, here, tmp_path) -> None:
    out = tmp_path / "dataset"
    running = started(python, small_stage, out, nodes.address)
    while not list(out.glob("records/*/*.json")) and running.poll() is None:
        time.sleep(0.05)
    nodes.say("kill", 0)
    nodes.say("add")
    assert "(8 pictures made, 0 already there" in ended(running)
    assert digests(out) == here


def test_a_url_gets_the_same_bytes(python, nodes, small_stage, here, tmp_path) -> None:
    out = tmp_path / "dataset"
    said = ended(started(python, small_stage, f"file://{out}", nodes.address))
    assert "(8 pictures made, 0 already there" in said
    assert digests(out) == here
    resumed = ended(started(python, small_stage, f"file://{out}", nodes.address))
    assert "(0 pictures made, 8 already there" in resumed


def test_a_run_that_is_stopped_at_once_leaves_no_folder_on_a_node(python, nodes, small_stage, tmp_path) -> None:
    running = started(python, small_stage, f"file://{tmp_path}/dataset", nodes.address, "--effort", "samples=100000")
    while not list(nodes.folder.glob(".spin_usd-node.*/dataset/stage")) and running.poll() is None:
        time.sleep(0.05)
    running.send_signal(signal.SIGINT)
    while "stops at once" not in running.stderr.readline():
        assert running.poll() is None
    running.send_signal(signal.SIGINT)
    _, warned = running.communicate()
    assert running.returncode == 128 + signal.SIGINT, warned
    assert list(nodes.folder.glob(".spin_usd-node.*")) == []


def test_no_cluster_is_one_sentence(python, small_stage, tmp_path) -> None:
    process = started(python, small_stage, tmp_path / "dataset", "127.0.0.1:1")
    _, warned = process.communicate()
    assert process.returncode == 2
    assert "--cluster 127.0.0.1:1: no Ray cluster answers" in warned
    assert len(warned.strip().splitlines()) == 1
    assert not (tmp_path / "dataset").exists()
