"""Shards that write one folder at the same time make what a single run makes, and keep out who would harm them."""

import json
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import replace
from threading import Timer

import pytest

from spin_usd.errors import InputError
from spin_usd.planning.manifest import (
    Manifest,
    read_manifest,
    refuse_other_shards,
    remove_finished_manifest,
    share_manifest,
    write_manifest,
)
from spin_usd.store import dataset_folder
from spin_usd.store.dataset_folder import Store
from spin_usd.store.lock import TEXT
from spin_usd.store.names import SHARDS
from tests.planning.shards.folder import content

SHARD = [sys.executable, "-m", "spin_usd.command_line", "render"]


def start(stage, out, shard, renderer):
    options = ["--renderer", renderer, "--effort", "samples=1", "--workers", "1", "--variants", "all", "--json"]
    return subprocess.Popen(
        [*SHARD, stage, "--out", out, "--shard", shard, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


@pytest.mark.slow
@pytest.mark.parametrize("renderer", ["raycast", "blender"])
def test_three_at_once_make_the_bytes_of_one_run(stage, whole, make, tmp_path, renderer) -> None:
    if renderer == "blender":
        make(tmp_path / "whole", renderer=renderer)
        whole = content(tmp_path / "whole")
    out = tmp_path / "dataset"
    runs = [start(stage, out, f"{number}/3", renderer) for number in range(3)]
    answers = [run.communicate() for run in runs]
    assert [run.returncode for run in runs] == [0, 0, 0], answers
    reports = [json.loads(stdout) for stdout, _ in answers]
    assert sum(report["made"] for report in reports) == 12
    assert sum(report["renders"] for report in reports) == 6
    assert {**whole, SHARDS: (out / SHARDS).read_bytes()} == content(out)
    assert make(out, renderer=renderer).made == 0
    assert content(out) == whole


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(dataset_folder, "PATIENCE_S", 0.2)


def test_a_shard_and_a_whole_run_refuse_each_other(impatient, tmp_path) -> None:
    store = Store(root=tmp_path)
    for first, second in ((None, "0-of-2"), ("0-of-2", None), ("0-of-2", "0-of-2")):
        with store.locked(first), pytest.raises(InputError, match="another run"), store.locked(second):
            pass
    assert list(tmp_path.iterdir()) == []


def test_shards_hold_the_folder_together_and_the_last_one_leaves_it_clean(impatient, tmp_path) -> None:
    store = Store(root=tmp_path)
    with ExitStack() as first, store.locked("1-of-2") as second:
        lease = first.enter_context(store.locked("0-of-2"))
        with store.exclusively():
            assert {*store.shards_at_work()} == {lease.work, second.work}
        first.close()
        assert {*store.shards_at_work()} == {second.work}
        with pytest.raises(InputError, match="another run"), store.locked():
            pass
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_shard_left_goes_with_the_next_whole_run(tmp_path) -> None:
    code = (
        "import os, pathlib, sys; from spin_usd.store.dataset_folder import Store\n"
        "store = Store(root=pathlib.Path(sys.argv[1]))\n"
        "with store.locked('0-of-2') as lease, store.exclusively():\n"
        "    (lease.work / 'half').write_text('x'); os.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path])
    assert len(list(tmp_path.iterdir())) == 4
    with Store(root=tmp_path).locked("1-of-2"):
        assert list(tmp_path.glob(".work-*/half"))
    with Store(root=tmp_path).locked():
        assert not list(tmp_path.glob(".work-*/half"))
    assert list(tmp_path.iterdir()) == []


MANIFEST = Manifest(count=2, stage="0" * 64, settings={"kinds": ["depth"]}, shards={"nominal": {"a": 0, "b": 1}})


OTHERS = (
    ({"count": 3}, "in another number of shards"),
    ({"stage": "1" * 64}, "of another stage"),
    ({"settings": {"kinds": ["range"]}}, r"with other options \(kinds\)"),
    ({"shards": {"nominal": {"a": 1, "b": 0}}}, "of other frames or variants"),
)


@pytest.mark.parametrize(("changed", "words"), OTHERS)
def test_a_shard_of_another_partition_is_refused_while_the_manifest_is_there(tmp_path, changed, words) -> None:
    """One that is being made and shares no manifest yet is in nobody's way: it will be refused itself."""
    store, other = Store(root=tmp_path), replace(MANIFEST, **changed)
    with store.locked("0-of-2") as mine, store.locked("1-of-2"):
        share_manifest(store, MANIFEST, work=mine.work)
        refuse_other_shards(store, MANIFEST, replaced=False)
        with pytest.raises(InputError, match=f"is being made {words}.*wait"):
            refuse_other_shards(store, other, replaced=True)
    with pytest.raises(InputError, match=f"was made {words}.*remove shards.json"):
        refuse_other_shards(store, other, replaced=False)
    refuse_other_shards(store, other, replaced=True)
    (tmp_path / SHARDS).unlink()
    refuse_other_shards(store, other, replaced=False)


@pytest.mark.slow
def test_shards_of_one_folder_are_partitioned_anew_after_a_run_without_shards(make, tmp_path) -> None:
    assert make(tmp_path, "0/4").made
    before = content(tmp_path)
    for shard, options in (("0/3", {}), ("1/4", {"labels": ("range",)}), ("1/4", {"variants": ("nominal",)})):
        with pytest.raises(InputError, match="was made "):
            make(tmp_path, shard, **options)
    assert content(tmp_path) == before
    make(tmp_path)
    assert not (tmp_path / SHARDS).exists()
    assert make(tmp_path, "0/3").reused == 4


def test_the_manifest_of_another_stage_goes_with_a_run_without_shards(tmp_path) -> None:
    """Its pictures may be none of that stage's, and would never be made."""
    (tmp_path / "stage").mkdir()
    write_manifest(Store(root=tmp_path), MANIFEST, work=tmp_path)
    remove_finished_manifest(Store(root=tmp_path))
    assert not (tmp_path / SHARDS).exists()


@pytest.mark.parametrize("text", ["", "[]", "{}", "[" * 100_000, '{"count": "x"}', '{"count": 1, "shards": []}'])
def test_what_is_not_a_manifest_is_neither_read_nor_replaced(tmp_path, text) -> None:
    (tmp_path / SHARDS).write_text(text)
    assert read_manifest(Store(root=tmp_path)) is None
    with pytest.raises(InputError, match=r"shards\.json: is not the manifest of shards"):
        write_manifest(Store(root=tmp_path), MANIFEST, work=tmp_path)
    assert (tmp_path / SHARDS).read_text() == text


def test_a_lock_that_is_just_being_written_is_waited_for(tmp_path) -> None:
    """Another shard made it an instant ago; its name is there before its token."""
    lock = tmp_path / ".lock"
    lock.touch()
    Timer(0.3, lock.write_text, [TEXT.format("0" * 32)]).start()
    Store(root=tmp_path).prepare()
    assert lock.stat().st_size
