"""Files at URLs: real ones of fsspec, in memory and on disk."""

import importlib.util

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.errors import InputError, OutputError
from spin_usd.store.publish.dataset_url import DatasetUrl, is_below

NAMES = ["dataset.json", "image/nominal/ä [1].png", "records/nominal/ä [1].json"]


@pytest.fixture(params=["memory", "file"])
def url(request, tmp_path):
    pytest.importorskip("fsspec")
    return DatasetUrl(f"{request.param}://{tmp_path}/some bucket/dataset")


@pytest.fixture
def file(tmp_path):
    (tmp_path / "given").write_bytes(b"bytes")
    return tmp_path / "given"


@given(st.lists(st.sampled_from(["a", "..", ".", "", "ä b"]), min_size=1, max_size=4))
def test_names_below_never_climb(parts) -> None:
    assert is_below("/".join(parts)) == all(part not in ("", ".", "..") for part in parts)


@pytest.mark.skipif(importlib.util.find_spec("fsspec") is not None, reason="fsspec is installed")
def test_without_fsspec_it_says_what_to_install() -> None:
    with pytest.raises(InputError, match="needs fsspec, which is not installed; run pip install fsspec s3fs"):
        DatasetUrl("s3://bucket/name")


@pytest.mark.parametrize(("url", "do"), [("s3://bucket/name", "pip install fsspec s3fs"), ("foo://a", "how the URL")])
def test_what_cannot_be_opened_says_what_to_do(url, do) -> None:
    pytest.importorskip("fsspec")
    with pytest.raises(InputError, match=f"cannot be opened .*{do}"):
        DatasetUrl(url)


def test_what_is_put_is_there_and_can_be_fetched(url, file, tmp_path) -> None:
    assert url.names() == []
    for name in NAMES:
        url.put(name, file)
        url.put(name, file)  # again: replaced
    assert url.names() == NAMES
    assert url.names("records") == NAMES[2:]
    assert url.read(NAMES[1]) == b"bytes"
    url.fetch(NAMES, tmp_path / "fetched")
    assert [(tmp_path / "fetched" / name).read_bytes() for name in NAMES] == [b"bytes"] * 3


def test_what_is_removed_is_gone_and_may_be_gone_already(url, file) -> None:
    url.put(NAMES[0], file)
    for _ in range(2):
        url.remove(NAMES[0])
    assert url.read(NAMES[0]) is None


def test_names_are_no_patterns(url, file, tmp_path) -> None:
    """fsspec's `get` of a list takes [ and * for patterns."""
    names = ["records/nominal/a[1].json", "records/nominal/a1.json"]
    url.put(names[1], file)
    file.write_bytes(b"bracketed")
    url.put(names[0], file)
    url.fetch(names[:1], tmp_path / "fetched")
    assert (tmp_path / "fetched" / names[0]).read_bytes() == b"bracketed"
    assert not (tmp_path / "fetched" / names[1]).exists()


def test_a_password_is_not_printed() -> None:
    pytest.importorskip("fsspec")
    with pytest.raises(InputError) as refused:
        DatasetUrl("nosuch://me:hunter2@host/folder")
    assert "hunter2" not in str(refused.value)
    assert "me:***@host" in str(refused.value)


def test_names_that_climb_are_not_fetched(url, tmp_path) -> None:
    with pytest.raises(InputError, match="is not the name of a file in a dataset"):
        url.fetch(["records/../../../climbed"], tmp_path / "fetched")


def test_a_put_that_breaks_off_leaves_the_old_file(tmp_path, file, monkeypatch) -> None:
    pytest.importorskip("fsspec")
    from fsspec.implementations.local import LocalFileSystem

    url = DatasetUrl(f"file://{tmp_path}/dataset")
    url.put(NAMES[0], file)
    file.write_bytes(b"other bytes")

    def half(self, source, target, **_):
        with open(target, "wb") as written:
            written.write(b"oth")
        raise OSError("no space left")

    monkeypatch.setattr(LocalFileSystem, "put_file", half)
    with pytest.raises(OutputError, match="cannot be written"):
        url.put(NAMES[0], file)
    assert url.read(NAMES[0]) == b"bytes"
    assert url.names() == NAMES[:1]
    url.remove_leftovers()
    assert [path.name for path in (tmp_path / "dataset").iterdir()] == NAMES[:1]


@pytest.mark.parametrize("given_url", ["s3://bucket/name", "nothing://x"])
def test_what_nothing_opens_is_one_sentence(given_url) -> None:
    pytest.importorskip("fsspec")
    with pytest.raises(InputError, match="cannot be opened"):
        DatasetUrl(given_url)
