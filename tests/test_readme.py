"""Every command of the README, run as a reader would run it."""

import re
import shlex
import shutil
import subprocess

import pytest
from conftest import REPOSITORY

README = (REPOSITORY / "README.md").read_text()
BLOCKS = re.findall(r"^```sh\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
FILES = re.findall(r"as `([\w/]+\.toml)`[^`]*?^```toml\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
COMMANDS = [line.partition("#")[0].strip() for block in BLOCKS for line in block.splitlines() if line.strip()]


def test_all_commands_are_ours():
    assert COMMANDS
    assert [path for path, _ in FILES] == ["my_stage/noisy.toml"]
    assert {shlex.split(c)[0] for c in COMMANDS} <= {"cp", "spin-usd", "tools/demo", "tools/test"}


@pytest.mark.slow
def test_the_commands_work_in_their_order(tmp_path, spin_usd):
    for command in COMMANDS:
        name, *arguments = shlex.split(command)
        if name == "cp":
            shutil.copy(REPOSITORY / arguments[0], tmp_path / arguments[1])
        elif name == "spin-usd":
            spin_usd(*arguments, cwd=tmp_path)
        for path, text in FILES:
            if (tmp_path / path).parent.is_dir():
                (tmp_path / path).write_text(text)
    pictures = [path.read_bytes() for path in sorted((tmp_path / "noisy" / "image").rglob("*.png"))]
    assert len(pictures) == len(set(pictures)) == 4


@pytest.mark.slow
def test_the_demo_ends_with_a_contact_sheet(tmp_path):
    done = subprocess.run(
        [REPOSITORY / "tools" / "demo", "--out", tmp_path / "demo"], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "demo" / "contact_sheet.png").is_file()
    assert len(list((tmp_path / "demo" / "dataset" / "image" / "nominal").glob("*.png"))) == 8


def test_the_files_named_in_the_readme_exist():
    for path in re.findall(r"\]\((\.?[\w./-]+)\)|\((schemas/[\w.-]+)\)", README):
        assert (REPOSITORY / "".join(path)).exists(), path


def test_the_cameras_named_in_the_readme_are_those_there_are():
    listed = re.search(r"\*\*Cameras\*\*: a name\s+\(([^)]*)\)", README)
    assert listed
    there = {path.stem for path in (REPOSITORY / "stages" / "cameras").glob("*.usda")}
    assert set(re.findall(r"`(\w+)`", listed[1])) == there


def test_the_presets_lights_and_environments_that_travel_along_are_named_in_the_readme():
    folders = (REPOSITORY / "stages" / "presets", REPOSITORY / "stages" / "environments")
    for path in (path for folder in folders for path in folder.glob("*.usda")):
        assert f"`{path.stem}`" in README, path.stem
