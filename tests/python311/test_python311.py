"""What needs no Blender works in an environment of Python 3.11 with the lowest versions that pyproject.toml allows."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY, speedplus_camera

PYTHON = REPOSITORY / ".venv-python311" / "bin" / "python"
LOADER = Path(__file__).with_name("load_batches.py")
POSES = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
pytestmark = [
    pytest.mark.children,
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.is_file(), reason="no .venv-python311; tools/python311_environment makes it"),
]


def run(python: str | Path, *arguments: object, code: int = 0) -> str:
    """What a Python prints, on both streams."""
    done = subprocess.run([str(each) for each in (python, *arguments)], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


def spin_usd(python: str | Path, *arguments: object, code: int = 0) -> str:
    return run(python, "-m", "spin_usd.command_line", *arguments, code=code)


@pytest.fixture(scope="module")
def stages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same stage authored by each Python."""
    folder = tmp_path_factory.mktemp("python311")
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    given = ("--poses", POSES, "--target", "tango", "--camera", folder / "camera.json", "--frames", "0:3")
    for name, python in (("ours", sys.executable), ("3.11", PYTHON)):
        spin_usd(python, "author", *given, "--out", folder / name, "--augment", "relight")
    return {"ours": folder / "ours", "3.11": folder / "3.11"}


@pytest.fixture(scope="module")
def dataset(stages: dict[str, Path]) -> Path:
    """Rendered by Python 3.11."""
    out = stages["3.11"].parent / "dataset"
    spin_usd(PYTHON, "render", stages["3.11"], "--out", out, "--renderer", "raycast")
    return out


def test_it_is_python_311() -> None:
    assert run(PYTHON, "--version").startswith("Python 3.11.")


def test_author_writes_the_same_bytes(stages: dict[str, Path]) -> None:
    files = {
        name: {path.relative_to(root): path.read_bytes() for path in root.rglob("*") if path.is_file()}
        for name, root in stages.items()
    }
    assert len(files["ours"]) > 20
    assert files["ours"] == files["3.11"]


def test_check_and_plan_work(stages: dict[str, Path], dataset: Path) -> None:
    assert "0 errors" in spin_usd(PYTHON, "check", stages["3.11"])
    assert "0 errors" in spin_usd(PYTHON, "check", dataset)
    assert "3 " in spin_usd(PYTHON, "plan", stages["3.11"])


def test_blender_is_refused_in_a_sentence(stages: dict[str, Path], tmp_path: Path) -> None:
    said = spin_usd(PYTHON, "render", stages["3.11"], "--out", tmp_path / "out", code=2)
    assert "the renderer blender needs bpy, which this Python 3.11" in said
    assert "Traceback" not in said
    assert not (tmp_path / "out").exists()
    assert "needs bpy" in spin_usd(PYTHON, "measure", stages["3.11"], "--out", tmp_path / "measured", code=2)


def test_labels_alone_are_made_without_asking_for_another_renderer(
    stages: dict[str, Path], dataset: Path, tmp_path: Path
) -> None:
    spin_usd(PYTHON, "render", stages["3.11"], "--out", tmp_path, "--labels-only")
    made, beside_images = (
        {path.name: path.read_bytes() for path in root.glob("depth/*/*")} for root in (tmp_path, dataset)
    )
    assert len(made) == 3
    assert made == beside_images


def test_batches_are_those_of_our_python(dataset: Path) -> None:
    found = json.loads(run(PYTHON, LOADER, dataset))
    assert found == json.loads(run(sys.executable, LOADER, dataset))
    assert len(found) == 3
    assert all(sums["image"] > 0 for sums in found.values())
