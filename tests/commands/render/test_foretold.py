"""A run into a new dataset says how long it takes, and where its first picture is; one that goes on says neither."""

import re

import pytest

import spin_usd as package


@pytest.fixture
def said(small_stage, tmp_path):
    """Render some frames into one dataset; returns the notes of that run."""

    def run(**options):
        notes: list[str] = []
        how = {"renderer": "raycast", "samples": 1, "workers": 1, "on_note": notes.append}
        package.render(small_stage, out=tmp_path / "made", **{**how, **options})
        return notes

    return run


def test_a_new_dataset_is_foretold_and_its_first_picture_told(said, tmp_path) -> None:
    expected, first = said(frames="0:2")
    assert re.fullmatch(r"2 pictures with 1 worker: about \d+ s", expected)
    path = tmp_path / "made" / "image" / "nominal" / "img000001.png"
    assert path.is_file()
    assert first == f"the first picture is made: {path}"
    assert said(frames="0:3") == []


def test_without_images_the_first_record_is_told(said, tmp_path) -> None:
    first = said(frames="0:1", labels_only=True, samples=None, renderer=None)[-1]
    path = tmp_path / "made" / "records" / "nominal" / "img000001.json"
    assert path.is_file()
    assert first == f"the first picture is made: {path}"
