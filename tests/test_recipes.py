"""CONTRIBUTING.md's recipes, followed to the letter on a copy of the repository, and seen to work in the commands."""

import json
import os
import re
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spin_usd.files.sha256 import sha256_of
from spin_usd.formats.image_file import read_image, write_image
from spin_usd.reading.dataset import Dataset
from tests.conftest import REPOSITORY

COPIED = (
    "spin_usd",
    "stages",
    "schemas",
    "docs",
    "tools/build_spec_schema",
    "tests/test_architecture.py",
    "tests/architecture.toml",
    "tests/conftest.py",
    "tests/library.py",
    "tests/commands/check/test_rules.py",
)
CONTRIBUTING = (REPOSITORY / "CONTRIBUTING.md").read_text()
RECIPES = dict(re.findall(r"^### An? ([^\n]+)\n(.*?)(?=^### |\Z)", CONTRIBUTING, re.MULTILINE | re.DOTALL))
RULES = "spin_usd/commands/check/rules.py"
POSES = """filename,qw,qx,qy,qz,x,y,z
middle.png,0.5,0.5,0.5,0.5,0,0,0.6
aside.png,1,0,0,0,0.19,0,0.6
"""
SPECIFICATION = """schema = "augment-1"
seed = 0

[[augmentation]]
name = "dim"

[augmentation.sample]
"exposure.fstop" = { distribution = "fixed", value = 8 }
"""
FLOAT32 = 1e-6  # relative: what two float32 roundings may come to


@dataclass(frozen=True)
class Step:
    """A block of code in a recipe: its language, its text, and the file that is named before it."""

    language: str
    text: str
    path: str


def steps(recipe: str) -> Iterator[Step]:
    """The recipe's blocks of code in order."""
    path = ""
    for named, language, text in re.findall(r"^`([\w/.-]+)`|^```(\w+)\n(.*?)^```$", recipe, re.MULTILINE | re.DOTALL):
        path = named or path
        if language:
            yield Step(language, text, path)


def patched(text: str, diff: str) -> str:
    """`text` after `diff`, whose lines stand one below the other in it, once."""
    lines = diff.splitlines(keepends=True)
    before = "".join(line[1:] for line in lines if line[0] in " -")
    after = "".join(line[1:] for line in lines if line[0] in " +")
    assert text.count(before) == 1, f"stands {text.count(before)} times:\n{before}"
    return text.replace(before, after)


class Copy:
    """A copy of the repository with an environment of its own, whose child processes import the copy too."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in (*COPIED, *(path.name for path in REPOSITORY.glob("*.md")), "pyproject.toml"):
            source, goal = REPOSITORY / name, folder / name
            goal.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, goal, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(source, goal)
        venv.create(folder / ".venv", symlinks=True)
        self.python = folder / ".venv" / "bin" / "python"
        (packages,) = (folder / ".venv").glob("lib/python*/site-packages")
        installed = [path for path in sys.path if path.endswith("site-packages")]
        (packages / "copy.pth").write_text("\n".join([str(folder), *installed]))

    def run(self, *arguments: object, code: int = 0) -> str:
        """Run Python in the copy; returns what it prints."""
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        command = [str(self.python), *map(str, arguments)]
        done = subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True)
        assert done.returncode == code, f"exit {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def spin_usd(self, *arguments: object, code: int = 0) -> str:
        return self.run("-m", "spin_usd.command_line", *arguments, code=code)

    def follow(self, step: Step) -> None:
        """Write the file, change the table, or run what the step says."""
        path = self.folder / step.path
        if step.language == "diff":
            path.write_text(patched(path.read_text(), step.text))
        elif step.language == "sh":
            self.run(*step.text.split()[1:])
        elif path.suffix == ".py":
            assert not path.exists()
            path.write_text(step.text)
        else:
            self.run("-c", step.text)
            assert path.is_file()


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    """The repository after all recipes."""
    made = Copy(tmp_path_factory.mktemp("recipes") / "repository")
    for recipe in RECIPES.values():
        for step in steps(recipe):
            made.follow(step)
    return made


def test_there_is_a_recipe_for_each_extension() -> None:
    wanted = {
        "label",
        "renderer",
        "option of `render`",
        "camera",
        "augmentation parameter",
        "pose-list format",
        "export format",
    }
    assert wanted | {"rule on a dataset's pictures", "rule on a stage"} <= set(RECIPES)


@pytest.mark.parametrize("recipe", RECIPES)
def test_a_recipe_is_one_new_file_and_one_table(recipe: str) -> None:
    made: set[Any] = set()
    changed: set[Any] = set()
    for step in steps(RECIPES[recipe]):
        if step.language != "sh":
            (changed if step.language == "diff" else made).add(step.path)
    assert len(made) == ("option" not in recipe)
    assert len(changed - {RULES}) == 1
    assert (RULES in changed) == ("rule" in recipe or recipe == "label")
    assert not any((REPOSITORY / path).exists() for path in made)


@pytest.mark.slow
def test_a_recipes_code_keeps_the_house_rules(copy: Copy) -> None:
    """Lint, format, and who may import whom."""
    new = [step.path for recipe in RECIPES.values() for step in steps(recipe) if step.path.endswith(".py")]
    for check in (["check"], ["format", "--check"]):
        copy.run("-m", "ruff", *check, *dict.fromkeys(new))
    copy.run("-m", "pytest", "-p", "no:cacheprovider", "tests/test_architecture.py", "-k", "table or cycle or formulas")
    copy.run("-m", "pytest", "-p", "no:cacheprovider", "tests/commands/check/test_rules.py")


@pytest.fixture(scope="module")
def dataset(copy: Copy) -> Path:
    """Two poses from the CSV file by the new camera, as they are and dimmed, with the new renderer and label."""
    (copy.folder / "poses.csv").write_text(POSES)
    (copy.folder / "dim.toml").write_text(SPECIFICATION)
    stage, out = copy.folder / "stage", copy.folder / "dataset"
    choices = ["--target", "cubesat", "--camera", "bench", "--augment", "dim.toml"]
    copy.spin_usd("author", "--poses", "poses.csv", *choices, "--out", stage)
    options = ["--renderer", "silhouette", "--samples", "1", "--labels", "default,radius", "--variants", "all"]
    copy.spin_usd("render", stage, "--out", out, *options, "--campaign", "orbit-1", "--workers", "1")
    return out


def read(dataset: Path, kind: str, picture: str) -> np.ndarray:
    (path,) = (dataset / kind).glob(f"{picture}.*")
    return read_image(path)[0]


def test_render_shows_every_recipes_work(dataset: Path) -> None:
    radius, dense = read(dataset, "radius", "nominal/middle"), read(dataset, "dense_pose", "nominal/middle")
    assert radius.shape == (72, 96)
    np.testing.assert_allclose(radius, np.linalg.norm(dense, axis=-1), rtol=FLOAT32)
    inside = radius > 0
    bright, dim = (read(dataset, "image", f"{variant}/middle")[inside] for variant in ("nominal", "dim"))
    assert inside.sum() > 200
    assert bright.mean() > 1.5 * dim.mean()
    record = json.loads((dataset / "records" / "nominal" / "middle.json").read_text())
    assert record["provenance"]["render"]["renderer"] == "silhouette"
    assert record["files"]["radius"]["unit"] == "m"
    assert np.array_equal(Dataset(dataset).picture("middle").label("radius"), radius)


def test_an_option_is_everywhere_by_its_one_line(copy: Copy, dataset: Path) -> None:
    """In the help, in the function's signature with its type, in each record, and in what shards agree on."""
    assert "--campaign NAME" in copy.spin_usd("render", "--help")
    signature = copy.run("-c", "import inspect, spin_usd; print(inspect.signature(spin_usd.render))")
    assert "campaign: str = ''" in signature
    assert "campaign: str = ''" in copy.run("-c", "import inspect, spin_usd; print(inspect.signature(spin_usd.plan))")
    record = json.loads((dataset / "records" / "nominal" / "middle.json").read_text())
    assert record["provenance"]["options"] == {"campaign": "orbit-1"}


def test_a_run_with_another_value_of_an_option_makes_the_images_again(copy: Copy, dataset: Path) -> None:
    """And one with the same makes none."""
    again = dataset.with_name("again")
    shutil.copytree(dataset, again)
    options = ["--renderer", "silhouette", "--samples", "1", "--labels", "default,radius", "--json", "--workers", "1"]
    for campaign, made in (("orbit-1", 0), ("orbit-2", 2)):
        report = copy.spin_usd("render", copy.folder / "stage", "--out", again, *options, "--campaign", campaign)
        assert json.loads(report)["made"] == made


def test_export_writes_the_new_format(copy: Copy, dataset: Path) -> None:
    copy.spin_usd("export", dataset, "--to", "centres", "--out", copy.folder / "centres")
    rows = (copy.folder / "centres" / "train.csv").read_text().splitlines()
    x0, y0, x1, y1 = Dataset(dataset).picture("middle").targets[0].box_visible.tolist()
    assert rows[0] == "name,u,v"
    assert f"middle-dim,{(x0 + x1) / 2},{(y0 + y1) / 2}" in rows
    assert (copy.folder / "centres" / "images" / "middle-dim.png").is_file()


def test_check_tells_of_the_new_rules_and_the_new_label(copy: Copy, dataset: Path) -> None:
    """The edge and a missing name are warned of; a radius that is wrong, though recorded so, is an error."""
    wrong = dataset.with_name("wrong")
    shutil.copytree(dataset, wrong)
    path, record = wrong / "radius" / "dim" / "middle.exr", wrong / "records" / "dim" / "middle.json"
    array = read_image(path)[0]
    path.unlink()
    write_image(path, array=array * np.float32(1.01), channels=("Y",))
    document = json.loads(record.read_text())
    document["files"]["radius"]["sha256"] = sha256_of(path)
    record.write_text(json.dumps(document))
    root = wrong / "stage" / "dataset.usda"
    root.write_text(re.sub(r'(spin:target:name = )"\w+"', r'\1""', root.read_text()))
    found = json.loads(copy.spin_usd("check", wrong, "--json", code=1))["findings"]
    told = {(finding["code"], finding["where"], finding["severity"]) for finding in found if finding["code"] != "cache"}
    assert ("edge", "records/nominal/aside.json", "warning") in told
    assert ("radius", "records/dim/middle.json", "error") in told
    assert ("target-name", "/World/Target", "warning") in told
    assert {code for code, _, severity in told if severity == "error"} == {"radius", "layer"}
    assert "edge" not in {code for code, where, _ in told if "middle" in where}
