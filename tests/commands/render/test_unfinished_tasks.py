"""A run says why it makes pictures again that the dataset has."""

import json

import pytest
from msgspec.structs import replace

import spin_usd as package
from spin_usd.commands.render.unfinished_tasks import OTHER_OPTIONS, OTHER_SOFTWARE, OTHER_STAGE, why_outdated
from spin_usd.files.folder import Folder
from spin_usd.store.read_documents import read_record


@pytest.fixture(scope="module")
def made(small_stage, tmp_path_factory):
    out = tmp_path_factory.mktemp("outdated") / "dataset"
    package.render(small_stage, out=out, frames="0:1", renderer="raycast", samples=1)
    return out


def record_in(dataset):
    (path,) = (dataset / "records" / "nominal").iterdir()
    return path, json.loads(path.read_text())


def again(stage, made, **options):
    said: list[str] = []
    package.render(stage, out=made, frames="0:1", renderer="raycast", on_note=said.append, **options)
    return said


def test_what_is_as_it_was_needs_no_word_and_other_options_do(small_stage, made) -> None:
    assert again(small_stage, made, samples=1) == []
    assert again(small_stage, made, samples=2) == [f"1 picture of the dataset, {OTHER_OPTIONS}, will be made again"]


def test_keys_that_nothing_else_explains_are_of_other_software(small_stage, made) -> None:
    path, record = record_in(made)
    record["provenance"]["keys"] = dict.fromkeys(record["provenance"]["keys"], "0" * 64)
    path.write_text(json.dumps(record))
    assert again(small_stage, made, samples=2) == [f"1 picture of the dataset, {OTHER_SOFTWARE}, will be made again"]


def test_another_state_of_the_stage_is_told_from_other_software(made) -> None:
    path, _ = record_in(made)
    record = read_record(Folder(path.parent), path.name)
    stage = record.provenance.stage
    assert why_outdated(record, record.settings, stage) == OTHER_SOFTWARE
    assert why_outdated(record, record.settings, replace(stage, hash="")) == OTHER_STAGE
