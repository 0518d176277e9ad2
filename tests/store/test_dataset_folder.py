import errno
import json
import os
import resource
import subprocess
import sys
from threading import Timer
from typing import Never

import pytest

from spin_usd.errors import InputError, OutputError, UnsupportedError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.sha256 import sha256_of
from spin_usd.store.atomic import fill_atomically, link_atomically, write_atomically, write_json
from spin_usd.store.dataset_folder import Store
from spin_usd.store.lock import TEXT


def files(folder):
    """By name, at any depth."""
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_failed_write_leaves_the_old_file_and_no_temporary(tmp_path) -> None:
    folder, path = Folder(tmp_path), tmp_path / "a.json"
    write_json(folder, "a.json", {"kept": 1}, work=tmp_path / "work")

    def fails(temporary) -> Never:
        temporary.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(OutputError, match="No space left"):
        fill_atomically(folder, "a.json", fails, work=tmp_path / "work")
    assert path.read_text() == '{\n "kept": 1\n}\n'
    assert files(tmp_path) == {"a.json"}


def test_a_refused_write_names_the_file_itself_and_leaves_no_temporary(tmp_path) -> None:
    def refuses(temporary) -> Never:
        temporary.write_text("half")
        raise UnsupportedError("cannot hold this", where=temporary)

    with pytest.raises(UnsupportedError, match="^" + str(tmp_path / "a.jpg") + ": cannot hold this$"):
        fill_atomically(Folder(tmp_path), "a.jpg", refuses, work=tmp_path / "work")
    assert not files(tmp_path)


def test_the_digest_is_that_of_the_file(tmp_path) -> None:
    digest = write_atomically(Folder(tmp_path), "x", lambda: b"abc", work=tmp_path)
    # FIPS 180-2, appendix B.1
    assert digest == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert sha256_of(tmp_path / "x") == digest


def test_a_write_beyond_the_file_size_limit_is_reported_and_leaves_nothing(tmp_path) -> None:
    """The kernel's own refusal, as on a full disk, from a process that may write files of 4 kB at most."""
    code = (
        "import signal, sys; from pathlib import Path; from spin_usd.store.atomic import write_atomically\n"
        "from spin_usd.errors import OutputError; from spin_usd.files.folder import Folder\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "path = Path(sys.argv[1])\n"
        "folder, write = Folder(path.parent), lambda: b'x' * 100_000\n"
        "try: write_atomically(folder, path.name, write, work=path.parent)\n"
        "except OutputError as e: print(e); sys.exit(7)"
    )
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))  # noqa: E731
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "big")], preexec_fn=limit, capture_output=True, text=True
    )
    assert done.returncode == 7, done.stderr
    assert "big" in done.stdout
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("held", ["Store(root=path).locked()", "new_folder(path / 'new')"])
@pytest.mark.parametrize("room", [0, 20])
def test_a_lock_for_which_there_is_no_room_is_not_left(tmp_path, room, held) -> None:
    code = (
        "import sys; from pathlib import Path; from spin_usd.store.dataset_folder import Store\n"
        "from spin_usd.store.new_folder import new_folder; from spin_usd.errors import OutputError\n"
        "path = Path(sys.argv[1])\n"
        f"try: {held}.__enter__()\n"
        "except OutputError as e: print(e); sys.exit(7)"
    )
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))  # noqa: E731
    done = subprocess.run([sys.executable, "-c", code, tmp_path], preexec_fn=limit, capture_output=True, text=True)
    assert done.returncode == 7, done.stderr
    assert "cannot be written" in done.stdout
    assert not list(tmp_path.iterdir())


def test_who_takes_the_lock_removes_what_a_killed_run_left_and_nothing_else(tmp_path) -> None:
    """A run is killed with a file half written; what is named like it stays."""
    code = (
        "import os, pathlib, sys; from spin_usd.store.dataset_folder import Store\n"
        "with Store(root=pathlib.Path(sys.argv[1])).locked() as lease:\n"
        "    (lease.work / 'deep').mkdir(); (lease.work / 'deep' / 'half').write_text('x'); os.kill(os.getpid(), 9)"
    )
    store = Store(root=tmp_path)
    subprocess.run([sys.executable, "-c", code, tmp_path])
    (left,) = tmp_path.glob(".work-*")
    others = {".work/t", ".work-" + "0" * 32 + "/t", "image/nominal/a.tmp-123.png", "image/.lock"}
    for name in others:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("mine")
    with store.locked() as lease:
        assert lease.work == left
        assert list(left.iterdir()) == []
    assert files(tmp_path) == others
    assert not left.exists()


@pytest.mark.parametrize("text", ["", "mine", "spin_usd " + "0" * 31 + "\n", "spin_usd " + "0" * 32 + "\nand more"])
def test_a_lock_that_is_not_ours_is_refused_and_stays(tmp_path, monkeypatch, text) -> None:
    monkeypatch.setattr("spin_usd.store.dataset_folder.PATIENCE_S", 0.2)
    (tmp_path / ".lock").write_text(text)
    with (
        pytest.raises(InputError, match=r"\.lock: exists and is not a lock of spin-usd"),
        Store(root=tmp_path).locked(),
    ):
        pass
    assert (tmp_path / ".lock").read_text() == text
    with pytest.raises(InputError, match=r"holds \.lock but no dataset\.json"):
        Store(root=tmp_path).prepare()


def test_a_second_run_on_the_same_dataset_is_refused(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("spin_usd.store.dataset_folder.PATIENCE_S", 0.2)
    store = Store(root=tmp_path)
    with store.locked(), pytest.raises(InputError, match="another run"), store.locked():
        pass


def test_a_run_that_waits_in_vain_does_not_take_the_lock_away(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("spin_usd.store.dataset_folder.PATIENCE_S", 0.2)
    store = Store(root=tmp_path)
    with store.locked() as lease:
        for _ in range(2):
            with pytest.raises(InputError, match="another run"), store.locked():
                pass
        assert lease.work.is_dir()


def test_a_run_without_result_leaves_no_folder(tmp_path) -> None:
    store = Store(root=tmp_path / "new")
    store.prepare()
    with store.locked():
        pass
    assert not (tmp_path / "new").exists()


def test_a_run_without_result_leaves_the_folder_that_was_there(tmp_path) -> None:
    store = Store(root=tmp_path)
    store.prepare()
    with store.locked():
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_foreign_files_is_refused(tmp_path) -> None:
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(InputError, match=r"no dataset\.json"):
        Store(root=tmp_path).prepare()


def test_an_output_path_that_is_a_file_is_refused(tmp_path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        Store(root=tmp_path / "file").prepare()


def refuse_links(*_, **__) -> Never:
    raise OSError(errno.EPERM, "no links here")


@pytest.mark.parametrize("links", [True, False])
def test_a_link_replaces_its_own_name_alone(tmp_path, monkeypatch, links) -> None:
    """Where there are no links, a copy does."""
    if not links:
        monkeypatch.setattr(os, "link", refuse_links)
    folder, work = Folder(tmp_path / "a"), tmp_path / "work"
    folder.root.mkdir()
    write_json(folder, "source", {"n": 1}, work=work)
    for _ in range(2):  # again over itself: to rename a file to another of its names does nothing
        link_atomically(folder, "path", FileIn(folder, "source"), work=work)
        link_atomically(folder, "other", FileIn(folder, "source"), work=work)
    assert (folder.inode("path") == folder.inode("source")) == links
    write_json(folder, "path", {"n": 2}, work=work)
    assert json.loads(folder.read("other", 100)) == json.loads(folder.read("source", 100)) == {"n": 1}
    assert files(tmp_path) == {"a/other", "a/path", "a/source"}


def test_a_link_to_nothing_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="none: is missing"):
        link_atomically(Folder(tmp_path), "path", FileIn(Folder(tmp_path), "none"), work=tmp_path / "work")
    assert not files(tmp_path)


def test_a_file_can_be_placed_by_its_digest(tmp_path) -> None:
    def place(sha256):
        return f"in/{sha256}"

    digest = write_atomically(Folder(tmp_path), "new", lambda: b"n", work=tmp_path, place=place)
    assert files(tmp_path) == {f"in/{digest}"}
    assert sha256_of(tmp_path / "in" / digest) == digest


@pytest.mark.parametrize("links", [True, False])
def test_a_file_has_a_second_name_or_a_copy_where_there_are_no_links(tmp_path, monkeypatch, links) -> None:
    if not links:
        monkeypatch.setattr(os, "link", lambda *_: (_ for _ in ()).throw(OSError(errno.EPERM, "no links here")))
    write_atomically(Folder(tmp_path), "a/b", lambda: b"n", work=tmp_path / "work", also="c/d", forced=False)
    assert files(tmp_path) == {"a/b", "c/d"}
    assert (tmp_path / "a/b").read_bytes() == (tmp_path / "c/d").read_bytes() == b"n"
    assert (tmp_path / "a/b").samefile(tmp_path / "c/d") == links


def test_a_second_name_that_cannot_be_had_leaves_no_temporary(tmp_path) -> None:
    (tmp_path / "c").write_text("no folder")
    with pytest.raises(OutputError, match="a/b: cannot be written"):
        write_atomically(Folder(tmp_path), "a/b", lambda: b"n", work=tmp_path / "work", also="c/d")
    assert files(tmp_path) == {"a/b", "c"}


def test_a_stage_is_not_taken_for_a_datasets_folder(tmp_path) -> None:
    (tmp_path / "dataset.usda").write_text("#usda 1.0")
    with pytest.raises(InputError, match="is a stage, and a dataset's folder is expected; choose an empty folder"):
        Store(root=tmp_path).prepare()


def test_a_lock_that_is_just_being_written_is_waited_for(tmp_path) -> None:
    """Another run made it an instant ago; its name is there before its token."""
    lock = tmp_path / ".lock"
    lock.touch()
    Timer(0.3, lock.write_text, [TEXT.format("0" * 32)]).start()
    Store(root=tmp_path).prepare()
    assert lock.stat().st_size
