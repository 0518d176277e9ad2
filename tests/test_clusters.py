"""What docs/how-to/cluster.md gives to run elsewhere: the array script of Slurm, and the container's steps."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY
from tests.test_documents import blocks

pytestmark = pytest.mark.children


PAGE = REPOSITORY / "docs" / "how-to" / "cluster.md"
DOCKERFILE = REPOSITORY / "tools" / "docker" / "Dockerfile"
BASE = {"libc6", "libgcc-s1", "libstdc++6", "zlib1g", "libuuid1", "libbsd0", "libmd0"}
"""Packages that Python's image has itself."""
EXTRAS = ("viser", "ray", "cascadio", "pyarrow", "pytest")
"""Modules that only an extra or a developer has."""


@pytest.fixture
def commands(tmp_path):
    """A folder of commands: spin-usd as this environment has it, and an srun that runs what it is given."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name, text in (
        ("spin-usd", f'exec {sys.executable} -m spin_usd.command_line "$@"'),
        ("srun", 'exec "$@"'),
    ):
        (folder / name).write_text(f"#!/bin/sh\n{text}\n")
        (folder / name).chmod(0o755)
    return folder


@pytest.mark.slow
def test_the_tasks_of_the_array_make_the_dataset(commands, small_stage, tmp_path, spin_usd) -> None:
    """As Slurm starts them, but one after the other."""
    (script,) = blocks(PAGE, "sbatch")
    (tmp_path / "array.sbatch").write_text(script)
    made = 0
    for number in range(3):
        environment = {
            "PATH": f"{commands}:{os.environ['PATH']}",
            "SLURM_ARRAY_TASK_ID": str(number),
            "SLURM_ARRAY_TASK_COUNT": "3",
            "SLURM_CPUS_PER_TASK": "1",
        }
        options = ["--renderer", "raycast", "--samples", "1", "--frames", "0:5", "--json"]
        done = subprocess.run(
            ["bash", tmp_path / "array.sbatch", small_stage, "shards", *options],
            env=environment,
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        made += json.loads(done.stdout)["made"]
    assert made == 5
    spin_usd("merge", *sorted((tmp_path / "shards").iterdir()), "--out", tmp_path / "dataset")
    again = spin_usd("render", small_stage, "--out", tmp_path / "dataset", *options)
    assert json.loads(again.stdout)["reused"] == 5


def instructions(name):
    """The arguments of the Dockerfile's instructions of that name."""
    text = re.sub(r"^#.*\n", "", DOCKERFILE.read_text(), flags=re.MULTILINE).replace("\\\n", " ")
    return [line.partition(" ")[2] for line in text.splitlines() if line.startswith(f"{name} ")]


def system_packages():
    (install,) = re.findall(r"apt-get install --yes --no-install-recommends([^&]+)", instructions("RUN")[0])
    return set(install.split())


def test_the_container_has_the_libraries_that_the_workflow_installs() -> None:
    workflow = (REPOSITORY / ".github" / "workflows" / "ci.yml").read_text()
    (listed,) = re.findall(r"apt-get install --yes (.*)", workflow)
    assert system_packages() == set(listed.split())


@pytest.mark.slow
def test_the_container_has_every_system_library_that_blender_loads() -> None:
    bpy = importlib.util.find_spec("bpy")
    if bpy is None or not shutil.which("dpkg-query") or not shutil.which("ldd"):
        pytest.skip("no Blender, or not a Debian system")
    loaded = re.findall(r"=> (/(?:usr/)?lib/\S+)", output("ldd", bpy.origin))
    needed = {owner(library) for library in loaded} - BASE
    assert needed
    assert needed <= with_dependencies(system_packages())


def owner(library):
    """The package that a library is of, in /lib or /usr/lib, which are one folder on newer systems."""
    return output("dpkg-query", "--search", f"*/{Path(library).resolve().name}").partition(":")[0]


def with_dependencies(packages):
    """These packages, and all that they depend on, as far as they are installed here."""
    known, new = set(), set(packages)
    while new:
        known |= new
        listed = output("dpkg-query", "--show", "--showformat", "${Depends}\n", *sorted(new))
        new = set(re.findall(r"(?:^|[,|]) *([a-z0-9.+-]+)", listed, re.MULTILINE)) - known
    return known


def output(*command):
    return subprocess.run(command, capture_output=True, text=True).stdout


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_the_steps_of_the_container_make_a_spin_usd_that_renders(tmp_path) -> None:
    """Its RUN lines in a folder of their own, but that of the system's packages; pip may have to load 1 GB. What they
    install is the wheel and what it needs, in an environment without anything else."""
    if not shutil.which("python3.13"):
        pytest.skip("no python3.13 on PATH")
    (source := tmp_path / "source").mkdir()
    ignored = (DOCKERFILE.parent / "Dockerfile.dockerignore").read_text()
    for name in re.findall(r"^!(.*)", ignored, re.MULTILINE):
        copy = shutil.copytree if (REPOSITORY / name).is_dir() else shutil.copyfile
        copy(REPOSITORY / name, source / name)
    for step in instructions("RUN")[1:]:
        done = subprocess.run(["sh", "-c", step], cwd=source, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    (folder,) = instructions("ENV")
    own = source / re.findall(r"(\.venv[^/]*)/bin", folder)[0] / "bin"
    smoke = [own / "spin-usd", "demo", "--quality", "preview", "--out", "demo"]
    subprocess.run(smoke, cwd=tmp_path, check=True)
    assert (tmp_path / "demo" / "contact_sheet.png").is_file()
    subprocess.run([own / "spin-usd", "check", "demo/dataset"], cwd=tmp_path, check=True)
    for module in EXTRAS:
        assert subprocess.run([own / "python", "-c", f"import {module}"], capture_output=True).returncode
    lacking = subprocess.run([own / "spin-usd", "keypoints", "tango"], cwd=tmp_path, capture_output=True, text=True)
    assert lacking.returncode == 2
    assert "pip install" in lacking.stderr
