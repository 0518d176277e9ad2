"""A picture that cannot be checked is a finding, and `check` goes on to the next, in the order of the records."""

import json
import shutil

import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.commands.check.calls import CheckPicture
from spin_usd.commands.check.dataset import dataset_findings
from spin_usd.commands.check.in_child.picture import picture_findings
from spin_usd.files.sha256 import sha256_of

pytestmark = pytest.mark.children


@pytest.fixture
def dataset(rendered, tmp_path):
    return shutil.copytree(rendered, tmp_path / "dataset")


def change(dataset, number, changed) -> str:
    """Change the record of one of the pictures, and return its name."""
    path = sorted((dataset / "records/nominal").iterdir())[number]
    record = json.loads(path.read_text())
    changed(record)
    path.write_text(json.dumps(record))
    return str(path.relative_to(dataset))


def damage(dataset, number, kind, damaged) -> str:
    """Put other bytes into a file of a picture and their digest into its record; return the file's name."""

    def changed(record) -> None:
        entry = record["files"][kind]
        path = dataset / entry["path"]
        content = path.read_bytes()
        path.unlink()  # the cache has the same file
        path.write_bytes(damaged(content))
        entry["sha256"] = sha256_of(path)
        names.append(entry["path"])

    names: list[str] = []
    change(dataset, number, changed)
    return names[0]


def errors(dataset):
    found = dataset_findings(dataset, progress=no_progress)
    return [(each.code, each.where) for each in found if each.severity == "error"]


def cut(content):
    return content[: len(content) // 2]


def not_utf8(content):
    """An EXR without a data window, and with an attribute whose name is not UTF-8 in its place."""
    return content.replace(b"dataWindow\0", b"data\xffindow\0")


def test_every_picture_that_cannot_be_read_is_told(dataset) -> None:
    """Also after one of another kind; a whole one has no finding."""
    first = damage(dataset, 0, "image", cut)
    second = damage(dataset, 1, "depth", not_utf8)
    assert errors(dataset) == [("unreadable", first), ("unreadable", second)]


IMPOSSIBLE = {
    "quaternion": lambda record: record["targets"][0]["pose"].update(q_cam_body=[2, 0, 0, 0]),
    "distortion": lambda record: record["camera"].update(distortion=[1e308] * 5),
    "long focal length": lambda record: record["camera"].update(fx=1e308),
    "range": lambda record: record["targets"][0].update(range=1e308),
    "focal length": lambda record: record["camera"].update(fx=1e-308),
    "box": lambda record: record["targets"][0]["box_3d"].update(box=[[-1e308] * 3, [1e308] * 3]),
    "translation": lambda record: record["targets"][0]["pose"].update(t_cam_body=[1e308, -1e308, 1e308]),
    "keypoints": lambda record: record["targets"][0].update(keypoints=[[1e308, 1e308, "visible"]] * 99),
}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # numpy warns of such numbers, and goes on
@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_impossible_numbers_are_findings(dataset, name) -> None:
    """The function that children run, here without one."""
    where = change(dataset, 0, IMPOSSIBLE[name])
    found = picture_findings(CheckPicture(dataset=str(dataset), record=where)).findings
    assert found
    assert {each.where for each in found} == {where}
