"""Every command of the README, run as a reader would run it, and its figures."""

import json
import re
import runpy
import shlex
import shutil
import subprocess
import sys

import pytest

from tests.conftest import REPOSITORY

README = (REPOSITORY / "README.md").read_text()
BLOCKS = re.findall(r"^```sh\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
FILES = re.findall(r"as `([\w/]+\.toml)`[^`]*?^```toml\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
COMMANDS = [line.partition("#")[0].strip() for block in BLOCKS for line in block.splitlines() if line.strip()]


def test_all_commands_are_ours() -> None:
    assert COMMANDS
    assert [path for path, _ in FILES] == ["my_stage/noisy.toml"]
    assert {shlex.split(c)[0] for c in COMMANDS} <= {"cp", "spin-usd", "tools/demo", "tools/test"}


@pytest.mark.slow
def test_the_commands_work_in_their_order(tmp_path, spin_usd) -> None:
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
    found = json.loads(spin_usd("check", tmp_path / "noisy", "--json").stdout)["findings"]
    assert not {"nearly-black", "nearly-white", "exposure-end"} & {finding["code"] for finding in found}


@pytest.mark.slow
def test_the_demo_ends_with_a_contact_sheet(tmp_path) -> None:
    done = subprocess.run(
        [REPOSITORY / "tools" / "demo", "--out", tmp_path / "demo"], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "demo" / "contact_sheet.png").is_file()
    assert len(list((tmp_path / "demo" / "dataset" / "image" / "nominal").glob("*.png"))) == 8


def test_the_files_named_in_the_readme_exist() -> None:
    for path in re.findall(r"\]\((\.?[\w./-]+)\)|\((schemas/[\w.-]+)\)", README):
        assert (REPOSITORY / "".join(path)).exists(), path


def test_the_cameras_named_in_the_readme_are_those_there_are() -> None:
    listed = re.search(r"\*\*Cameras\*\*: a name\s+\(([^)]*)\)", README)
    assert listed
    there = {path.stem for path in (REPOSITORY / "stages" / "cameras").glob("*.usda")}
    assert set(re.findall(r"`(\w+)`", listed[1])) == there


def test_the_presets_lights_and_environments_that_travel_along_are_named_in_the_readme() -> None:
    folders = (REPOSITORY / "stages" / "presets", REPOSITORY / "stages" / "environments")
    for path in (path for folder in folders for path in folder.glob("*.usda")):
        assert f"`{path.stem}`" in README, path.stem


def test_the_readme_has_every_block_of_figures_once(monkeypatch) -> None:
    monkeypatch.syspath_prepend(REPOSITORY / "tools")
    blocks = runpy.run_path(str(REPOSITORY / "tools" / "build_readme"))["BLOCKS"]
    assert re.findall(r"^<!-- generated: (\w+) -->$", README, re.MULTILINE) == list(blocks)


def build_readme(*arguments):
    command = [sys.executable, REPOSITORY / "tools" / "build_readme", *arguments]
    return subprocess.run(command, capture_output=True, text=True)


def test_the_figures_of_the_readme_are_those_measured() -> None:
    done = build_readme("--check")
    assert done.returncode == 0, done.stderr


def test_a_block_that_is_not_what_its_figures_make_is_named_and_mended(tmp_path) -> None:
    spread = {"median": 2.0, "least": 1.0, "most": 4.0}
    case = {"stage": "matt", "effort": "samples=4", "predicted_s": 2.2, "taken_s": spread, "predicted_over_taken": 1.1}
    (tmp_path / "bench.json").write_text(json.dumps({"predict": {"cases": [case]}}))
    readme, own = tmp_path / "README.md", "before\n<!-- generated: predicted -->\n{}<!-- end -->\nafter\n"
    readme.write_text(own.format("old\n"))
    asked = ["--figures", tmp_path, "--readme", readme]
    stale = build_readme(*asked, "--check")
    assert stale.returncode == 1
    assert str(readme) in stale.stderr
    assert readme.read_text() == own.format("old\n")
    assert build_readme(*asked).returncode == 0
    assert build_readme(*asked, "--check").returncode == 0
    assert "| matt, `samples=4` | 2.2 | 2 (1 to 4) | 10 % |" in readme.read_text()
    assert readme.read_text().startswith("before\n")
    assert readme.read_text().endswith("after\n")


def test_a_block_without_figures_is_empty_and_told(tmp_path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("<!-- generated: predicted -->\nold\n<!-- end -->\n")
    done = build_readme("--figures", tmp_path, "--readme", readme)
    assert done.returncode == 0
    assert "predicted: not measured yet: run tools/bench predict" in done.stderr
    assert readme.read_text() == "<!-- generated: predicted -->\n<!-- end -->\n"
