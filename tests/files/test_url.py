"""What is a URL, what is a path, and what is neither."""

from pathlib import Path

import pytest

import spin_usd
from spin_usd.errors import InputError
from spin_usd.files.url import is_url, refuse_unless_path, to_install


@pytest.mark.parametrize(
    "given", ["s3://bucket/name", "file:///data", "gs://b/a b", "simplecache::s3://b/x", "x+y://a"]
)
def test_urls(given) -> None:
    assert is_url(given)
    with pytest.raises(InputError, match=r"is a URL, and a path is expected; (fetch it|give /data$)"):
        refuse_unless_path(given, "stage")
    with pytest.raises(InputError, match=r"is expected; give (a folder, and copy that there|/data$)"):
        refuse_unless_path(given, "--out")


@pytest.mark.parametrize("given", ["dataset", "/data/s3:/x", "a b://c", "C:/data", "10:30", "a:b", ".", Path(), "x//y"])
def test_paths(given) -> None:
    assert not is_url(given)
    refuse_unless_path(given, "stage")


MISTYPED = ["s3:/b/x", "./s3:/b/x", Path("s3://b/x"), "s3:b", "s3://", "file://x", "file:x", "foo:/x", "ab::b", "S3:x"]


@pytest.mark.parametrize("given", MISTYPED)
def test_a_mistyped_url_is_no_path(given) -> None:
    with pytest.raises(InputError, match=r"is neither a URL nor a path; write .*://"):
        is_url(given)
    with pytest.raises(InputError, match="is a URL, and a path is expected"):
        refuse_unless_path(given, "stage")


@pytest.mark.parametrize(
    ("url", "command"),
    [
        ("s3://b/x", "pip install fsspec s3fs"),
        ("simplecache::gs://b", "pip install fsspec gcsfs"),
        ("file:///data", "pip install fsspec"),
        ("foo://b", "pip install fsspec"),
    ],
)
def test_what_to_install(url, command) -> None:
    assert to_install(url) == command


URLS = [
    ("render", ("stage", "--out", "s3:/b/x"), "is neither a URL nor a path"),
    ("check", ("s3://b/x",), "is a URL, and a path is"),
    ("merge", ("a", "gs://b/x", "--out", "c"), "is a URL, and a path is"),
    ("export", ("s3://b/x", "--to", "bop", "--out", "c"), "is a URL, and a path is"),
    ("author", ("--minimal", "--out", "s3://b/x"), "is a URL, and a path is"),
    ("doctor", ("--folder", "./s3:/b"), "is a URL, and a path is"),
    ("render", ("stage", "--out", ""), "--out is ''"),
    ("merge", ("a", "", "--out", "c"), "SHARD is ''; make it a path"),
]


@pytest.mark.parametrize(("command", "arguments", "said"), URLS)
def test_no_command_takes_one_for_a_folder(spin_usd, tmp_path, command, arguments, said) -> None:
    done = spin_usd(command, *arguments, code=2, cwd=tmp_path)
    assert said in done.stderr
    assert not list(tmp_path.iterdir())


def test_no_function_takes_one_for_a_folder(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for given, said in (("", "is ''"), ("s3:/b", "is a URL"), (Path("s3://b"), "is a URL")):
        with pytest.raises(InputError, match=said):
            spin_usd.merge([given], out="c")
        with pytest.raises(InputError, match=said):
            spin_usd.Dataset(given)
    with pytest.raises(InputError, match="neither a URL"):
        spin_usd.render("stage", out=Path("s3://b"))
    assert not list(tmp_path.iterdir())
