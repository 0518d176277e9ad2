"""The door of records: what a record says is of its type, and one of another version is read as far as it goes."""

import json

import pytest

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.scene.effort import CPU
from spin_usd.store.read_documents import decoded_record, read_record, recorded_files


@pytest.fixture(scope="module")
def made(rendered):
    return min((rendered / "records" / "nominal").iterdir())


def changed(path, where, value):
    """The bytes of the record with another value at that path."""
    record = json.loads(path.read_text())
    *above, last = where
    inner = record
    for name in above:
        inner = inner[name]
    inner[last] = value
    return json.dumps(record).encode()


def test_types_say_what_the_record_says(made) -> None:
    said, record = json.loads(made.read_text()), read_record(Folder(made.parent), made.name)
    assert record.frame == said["frame"]
    assert record.pose.T_cam_body.quaternion.tolist() == pytest.approx(said["pose"]["q_cam_body"], abs=1e-15)
    assert record.camera.camera.fx == said["camera"]["fx"]
    assert record.settings.effort.samples == said["provenance"]["render"]["effort"]["samples"]
    assert recorded_files(record, record.variant, record.frame) == {
        kind: file["path"] for kind, file in said["files"].items()
    }
    assert recorded_files(record, record.variant, "another") == {}


def test_an_older_record_says_less_and_a_later_one_more(made) -> None:
    record = json.loads(made.read_text())
    del record["appearance"], record["provenance"]["render"]["device"]
    del record["provenance"]["render"]["effort"]["filter_glossy"]
    record["mood"] = record["camera"]["shutter"] = "calm"
    assert decoded_record(json.dumps(record).encode(), made).settings.device == CPU


@pytest.mark.parametrize(
    ("where", "value", "words"),
    [
        (["schema"], "record-2", "is of schema 'record-2', and this version reads record-1"),
        (["pose"], None, r"breaks schema record-1 at \$.pose: None is not of type 'object'"),
        (["targets", 0, "range"], -1, r"breaks schema record-1 at \$.targets\[0\].range: -1 is less than the minimum"),
        (["provenance", "keys"], {}, r"at \$.provenance.keys: 'geometry' is a required property"),
        (["camera", "fx"], float("inf"), "is not JSON"),
        (["index"], "first", r"at \$.index: 'first' is not of type 'integer'"),
    ],
)
def test_another_record_is_refused_with_what_is_wrong_where(made, where, value, words) -> None:
    with pytest.raises(InputError, match=words) as refused:
        decoded_record(changed(made, where, value), made)
    assert refused.value.do


@pytest.mark.parametrize("data", [b"", b"[]", b"{" * 100_000, b"\xff", b"null", b"[" * 100_000], ids=range(6))
def test_what_is_no_record_is_refused(data, tmp_path) -> None:
    with pytest.raises(InputError):
        decoded_record(data, tmp_path)
