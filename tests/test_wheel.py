"""A built wheel works outside the checkout: the stages and schemas travel in it."""

import hashlib
import os
import subprocess
import sys

import pytest

from spin_usd.commands.show.gallery_folder import page_files
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.children


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The wheel's content unpacked into a folder of its own, as pip would lay it out."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder]
    subprocess.run(build, check=True, cwd=REPOSITORY, capture_output=True)
    wheel = next(folder.glob("*.whl"))
    install = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-index", "-t", folder / "site", wheel]
    subprocess.run(install, check=True, capture_output=True)
    return folder / "site"


def test_the_wheel_authors_and_renders_elsewhere(installed, tmp_path) -> None:
    """In this environment, but with the wheel's package before the checkout's."""
    code = (
        "import sys, pathlib; sys.path.insert(0, sys.argv[1]); import spin_usd\n"
        "assert pathlib.Path(spin_usd.__file__).is_relative_to(sys.argv[1])\n"
        "from spin_usd.basics import resources; from spin_usd.commands.author.in_child import author_stage\n"
        "assert resources.stages().is_relative_to(sys.argv[1]) and resources.schemas().is_relative_to(sys.argv[1])\n"
        "poses = resources.stages() / 'examples' / 'tango_speedplus_poses.json'\n"
        "print(author_stage(poses=poses, target='tango', camera='speedplus', out='stage').frames)"
    )
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-c", code, installed], capture_output=True, text=True, cwd=tmp_path, env=environment
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-1] == "8"
    assert (tmp_path / "stage" / "dataset.usda").is_file()


def test_the_command_line_starts_without_blender_or_usd(installed) -> None:
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import spin_usd.command_line\n"
        "print(sorted({'bpy', 'pxr'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code, installed], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_page_of_show_travels_in_the_wheel(installed) -> None:
    """Every file that the checkout's page has, byte for byte."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); from spin_usd.commands.show.gallery_folder import page_files\n"
        "import hashlib; print(*(hashlib.sha256(data).hexdigest() for data in page_files().values()))"
    )
    done = subprocess.run([sys.executable, "-c", code, installed], capture_output=True, text=True, check=True)
    own = [hashlib.sha256(data).hexdigest() for data in page_files().values()]
    assert done.stdout.split() == own
