"""Reading a dataset needs few packages; what needs those of the extra [render] says so where one is missing."""

import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from spin_usd.basics.extras import EXTRAS, to_install
from spin_usd.commands.doctor.run import examine
from spin_usd.errors import MissingPackageError
from spin_usd.options import Options, takes
from tests.conftest import REPOSITORY

READ = """
import sys, spin_usd
dataset = spin_usd.Dataset(sys.argv[1])
crops = dataset.where("visible > 0.5").split(1.0)[0].crop("cubesat", 64)
batch = dataset.collate([*crops], labels=["image", "depth", "segmentation", "dense_pose"])
assert batch["dense_pose"].shape == (len(dataset), 64, 64, 3), batch["dense_pose"].shape
assert batch["depth"].max() > 1 and dataset.resize((60, 40))[0].image.shape == (40, 60)
try:
    from torch.utils.data import DataLoader
except ModuleNotFoundError:
    pass
else:
    (loaded,) = DataLoader(crops, batch_size=len(crops), num_workers=1, collate_fn=dataset.collate)
    assert (loaded["image"] == batch["image"]).all()
"""
RENDER = EXTRAS["render"].packages
BLOCK = """
import sys
class Missing:
    def find_spec(name, path=None, target=None):
        if name in blocked:
            raise ModuleNotFoundError(name=name)
blocked = set(sys.argv.pop(1).split(","))
sys.meta_path.insert(0, Missing)
"""
COMMAND_LINE = BLOCK + "from spin_usd.__main__ import run; run()"
OTHER_PYTHON = REPOSITORY / ".venv-python311"
TRAINING = REPOSITORY / ".venv-train" / "lib" / "python3.11" / "site-packages"  # PyTorch


def run(python: Path | str, *arguments: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([str(python), *map(str, arguments)], capture_output=True, text=True)


def test_the_table_of_extras_is_the_projects() -> None:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    found = packages_distributions()
    assert extras.keys() - {"all"} == EXTRAS.keys()
    extras["read"] = project["dependencies"]
    assert extras["all"] == [f"spin_usd[{','.join(name for name in extras if name not in ('read', 'render', 'all'))}]"]
    for name, extra in EXTRAS.items():
        names = {re.split(r"[\[>=]", each)[0] for each in extras[name]} - {"spin_usd"}
        assert {*extra.packages.values()} - {"pyerfa"} == names  # which astropy brings
        there = {module: package for module, package in extra.packages.items() if module in found}
        assert {module: found[module] for module in there} == {module: [package] for module, package in there.items()}
        assert name != "render" or there == extra.packages


def test_the_remedy_names_the_versions_that_are_needed_and_the_pip(monkeypatch) -> None:
    wanted = "install 'pyzmq>=27' 'ray[client]>=2.50' other"
    monkeypatch.setenv("VIRTUAL_ENV", sys.prefix)
    assert to_install("pyzmq", "ray", "other") == f"run pip {wanted}"
    monkeypatch.delenv("VIRTUAL_ENV")
    assert to_install("pyzmq", "ray", "other") == f"run {sys.executable} -m pip {wanted}"


def test_a_dataset_is_read_without_the_packages_that_render(rendered) -> None:
    done = run(sys.executable, "-c", BLOCK + READ, ",".join(RENDER), rendered)
    assert done.returncode == 0, done.stderr


def test_predictions_are_scored_without_them_too(rendered) -> None:
    poses = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
    code = "import sys, spin_usd\nprint(*spin_usd.score(sys.argv[1], truth=sys.argv[2], partial=True).notes, sep='\\n')"
    done = run(sys.executable, "-c", BLOCK + code, ",".join(RENDER), poses, rendered)
    assert done.returncode == 0, done.stderr
    assert "ADD and BOP's recalls, which take the target's points, are left out: psutil is not installed" in done.stdout


@pytest.mark.parametrize(("module", "package"), [("typer", "typer"), ("psutil", "psutil"), ("pxr", "usd-core")])
def test_a_command_says_which_package_is_missing(module, package, small_stage) -> None:
    done = run(sys.executable, "-c", COMMAND_LINE, module, "plan", small_stage)
    assert done.returncode == 2
    said = f"{package} is not installed; {to_install(package)} (the extra spin_usd[render])"
    assert done.stderr.splitlines()[-1] == f"spin-usd: {said}"


def test_a_function_that_cannot_be_loaded_says_which_package_is_missing() -> None:
    code = f"{BLOCK}import spin_usd\ntry: spin_usd.plan\nexcept spin_usd.SpinError as e: print(e)"
    assert "psutil is not installed" in run(sys.executable, "-c", code, "psutil").stdout


@pytest.mark.parametrize("blocked", ["psutil", "scipy", ",".join(RENDER)])
def test_a_fresh_dataset_names_the_extra_that_it_needs(blocked, tmp_path) -> None:
    code = "import spin_usd\ntry: spin_usd.FreshDataset(sys.argv[1], 'x')\nexcept spin_usd.SpinError as e: print(e)"
    done = run(sys.executable, "-c", BLOCK + code, blocked, tmp_path)
    assert re.search(r" not installed; run .*pip install .*\(the extra spin_usd\[render\]\)$", done.stdout), done


def test_a_function_that_needs_a_missing_package_later_says_which(monkeypatch) -> None:
    @takes(Options)
    def function(_: Options) -> None:
        import cv2  # noqa: F401

    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(MissingPackageError, match="opencv-python-headless is not installed"):
        function()


def test_doctor_says_which_package_is_missing(monkeypatch, spin_usd) -> None:
    monkeypatch.setitem(RENDER, "missing", "missing-package")
    monkeypatch.setitem(EXTRAS["serve"].packages, "zmq_missing", "pyzmq")
    lines = spin_usd("doctor", code=1).stdout.splitlines()
    place = next(
        place for place, line in enumerate(lines) if line.split() == ["NO", "missing-package", "not", "installed"]
    )
    assert lines[place + 1].strip() == f"-> {to_install('missing-package')}"
    assert any("[serve]" in line and f"for serve: not installed; if you want it, {to_install('pyzmq')}" in line
               for line in lines)  # fmt: skip


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder]
    subprocess.run(build, check=True, cwd=REPOSITORY, capture_output=True)
    (made,) = folder.glob("*.whl")
    return Path(made)


@pytest.mark.slow
@pytest.mark.parametrize("base", [sys.prefix, OTHER_PYTHON], ids=["3.13", "3.11"])
def test_the_base_stands_beside_what_trains(base, wheel, rendered, tmp_path) -> None:
    """Few packages are installed beside OpenCV 4, which stays, and PyTorch, where there is one."""
    if not Path(base, "bin", "python").is_file():
        pytest.skip("no .venv-python311; tools/python311_environment makes it")
    run(Path(base, "bin", "python"), "-m", "venv", tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    if run(python, "-m", "pip", "install", "opencv-python-headless<5").returncode:
        pytest.skip("no package index")
    before = run(python, "-m", "pip", "freeze").stdout.splitlines()
    done = run(python, "-m", "pip", "install", f"{wheel}[read]")
    assert done.returncode == 0, done.stderr
    after = run(python, "-m", "pip", "freeze").stdout.splitlines()
    assert set(before) <= set(after)
    assert len(after) - len(before) <= 10
    if base == OTHER_PYTHON and TRAINING.is_dir():
        (packages,) = tmp_path.glob("venv/lib/*/site-packages")
        (packages / "training.pth").write_text(str(TRAINING))
    done = run(python, "-c", READ, rendered)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("system", "machine", "library", "well"),
    [
        ("Linux", "x86_64", ("glibc", "2.28"), True),
        ("Linux", "x86_64", ("glibc", "2.17"), False),
        ("Linux", "aarch64", ("glibc", "2.36"), False),
        ("Linux", "x86_64", ("", ""), False),
        ("Darwin", "arm64", ("", ""), False),
    ],
)
def test_doctor_says_on_which_systems_it_was_tried(monkeypatch, system, machine, library, well) -> None:
    monkeypatch.setattr("platform.system", lambda: system)
    monkeypatch.setattr("platform.machine", lambda: machine)
    monkeypatch.setattr("platform.libc_ver", lambda: library)
    line = next(line for line in examine(REPOSITORY) if line.subject == "system")
    assert (line.well, line.found.split()[:3]) == (well, [system, "on", f"{machine},"])
