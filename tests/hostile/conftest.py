"""One authored stage and one dataset for all hostile inputs, and files of the user's beside them."""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from spin_usd.commands.check.calls import CHECK_STAGE, CheckStage
from spin_usd.errors import SpinError
from spin_usd.processes.child import Child


def slow(*values):
    """Parameters of a test that is left to slow runs, as others show the same rule."""
    return pytest.param(*values, marks=pytest.mark.slow)


BOX = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 3 4\n"
CAMERA = {"Nu": 64, "Nv": 48, "cameraMatrix": [[100, 0, 32], [0, 100, 24], [0, 0, 1]], "distCoeffs": [0, 0, 0, 0, 0]}
POSE = {"filename": "img000001.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 5]}
RECORD = "records/nominal/img000001.json"


@dataclass(frozen=True)
class Place:
    """A folder with what `author` reads, the stage `st`, its dataset `ds` and, apart from them, files of the user's."""

    folder: Path
    users: Path

    @property
    def stage(self) -> Path:
        return self.folder / "st"

    @property
    def dataset(self) -> Path:
        return self.folder / "ds"

    def author(self, *options, out="out"):
        """The arguments of `author` with its usual inputs, but those that the options give."""
        usual = {"--poses": "poses.json", "--camera": "camera.json", "--target": "box.obj", "--units-per-metre": "1"}
        chosen = {**usual, **dict(zip(options[::2], options[1::2], strict=True))}
        return ("author", *(word for pair in chosen.items() for word in pair), "--any-size", "--out", out)

    def render(self, out="ds"):
        return ("render", "st/dataset.usda", "--renderer", "raycast", "--workers", "1", "--out", out)

    def change(self, name, change):
        """Change a JSON document of the dataset."""
        document = json.loads((self.dataset / name).read_text())
        change(document)
        (self.dataset / name).write_text(json.dumps(document))

    def contents(self):
        """What the user's own files hold."""
        return {str(p.relative_to(self.users)): p.read_text() for p in sorted(self.users.rglob("*")) if p.is_file()}


@pytest.fixture(scope="session")
def made(tmp_path_factory, spin_usd):
    """The inputs, the stage and the dataset that all tests copy."""
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "box.obj").write_text(BOX)
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    (folder / "poses.json").write_text(json.dumps([POSE]))
    place = Place(folder, folder)
    spin_usd(*place.author(out="st"), cwd=folder)
    spin_usd(*place.render(), cwd=folder)
    return folder


@pytest.fixture
def place(made, tmp_path):
    """A copy of it all, and the user's own files outside."""
    folder, users = tmp_path / "work", tmp_path / "users"
    shutil.copytree(made, folder)
    (users / "run.tmp-1").mkdir(parents=True)
    for name in ("run.tmp-1/thesis", "a.tmp-b", "img9.png", "img000001.png", "img000001.json"):
        (users / name).write_text("precious")
    (users / "secret.usda").write_text('#usda 1.0\n(\n    defaultPrim = "Secret"\n)\ndef Cube "Secret"\n{\n}\n')
    return Place(folder, users)


@pytest.fixture(scope="session")
def child():
    """One child process, which is asked for one thing after another; as a command's child, it says what was wrong."""
    with Child() as child:
        yield child


@pytest.fixture
def checked(child):
    """The findings on the stage in a file, or the sentence that refuses it."""

    def check(stage):
        try:
            request = CheckStage(stage=str(stage))
            found = child.call(CHECK_STAGE, request, progress=lambda *_: None, within_s=20).findings
        except SpinError as refusal:
            return str(refusal)
        return [finding.message for finding in found]

    return check
