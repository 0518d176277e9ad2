"""One picture to a URL: in an order that leaves no record of files that are not there."""

import json
import shutil

import pytest

from spin_usd.errors import SpinError
from spin_usd.store.publish.mirror import publish_picture


class Listing:
    """Stands before a URL and notes what is asked of it, in order."""

    def __init__(self, url):
        self.url, self.asked = url, []

    def __getattr__(self, method):
        def ask(name, *more):
            if method in ("put", "remove"):
                self.asked.append((method, name))
            return getattr(self.url, method)(name, *more)

        return ask


@pytest.fixture
def there(tmp_path):
    pytest.importorskip("fsspec")
    from spin_usd.store.publish.dataset_url import DatasetUrl

    return Listing(DatasetUrl(f"memory://{tmp_path}"))


@pytest.fixture
def picture(rendered, tmp_path):
    """Copy a picture of a real dataset as a folder of its own; returns that, and the record's name."""

    def copied(*, without=()):
        source = next((rendered / "records").rglob("*.json"))
        record = json.loads(source.read_text())
        root, name = tmp_path / "node", source.relative_to(rendered).as_posix()
        for kind in without:
            del record["files"][kind]
        for entry in record["files"].values():
            (root / entry["path"]).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(rendered / entry["path"], root / entry["path"])
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(json.dumps(record))
        return root, name

    return copied


def test_the_record_comes_last_and_the_machine_keeps_nothing(there, picture) -> None:
    root, record = picture()
    publish_picture(root, record, there)
    assert [method for method, _ in there.asked] == ["put"] * len(there.asked)
    assert there.asked[-1] == ("put", record)
    listed = json.loads(there.url.read(record))["files"].values()
    assert {name for _, name in there.asked[:-1]} == {entry["path"] for entry in listed}
    assert not [path for path in root.rglob("*") if path.is_file()]


def test_an_old_record_goes_before_its_files_are_replaced(there, picture) -> None:
    root, record = picture()
    publish_picture(root, record, there)
    there.asked.clear()
    root, record = picture(without=["depth"])
    publish_picture(root, record, there)
    assert there.asked[0] == ("remove", record)
    assert there.asked[-1][0] == "remove"
    assert there.asked[-1][1].startswith("depth/")
    assert there.asked[-2] == ("put", record)


@pytest.mark.parametrize("name", ["records/../../etc.json", "records/nominal/a/b.json", "/records/a/b.json", "x.json"])
def test_a_name_that_is_no_record_is_refused(there, picture, name) -> None:
    root, _ = picture()
    with pytest.raises(SpinError):
        publish_picture(root, name, there)
    assert not there.asked
