"""`check --cross` on a real dataset: Cycles agrees with what Embree made, and finds what was changed."""

import json

import numpy as np
import pytest

import spin_usd as package
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.formats.array_file import write_array
from spin_usd.labels.table import LABELS


@pytest.fixture
def described(tmp_path):
    """A folder that is a dataset by its description alone."""
    (tmp_path / "dataset.json").write_text("{}")
    return tmp_path


@pytest.mark.slow
def test_cycles_agrees_and_finds_what_was_changed(small_stage, tmp_path, spin_usd) -> None:
    """The second picture's depth is moved by a pixel; its digest, which `check` holds too, is another finding."""
    made = tmp_path / "dataset"
    package.render(small_stage, out=made, frames="0:3", labels_only=True, workers=1)
    picture = package.Dataset(made)[1]
    moved = np.roll(picture.label("depth"), 1, axis=1)
    write_array(made / picture.files["depth"].path, moved, kind="depth", channels=LABELS["depth"].channels)
    said = json.loads(spin_usd("check", made, "--cross", "--json", code=1).stdout)
    crossed = [finding for finding in said["findings"] if finding["code"] == "cross"]
    assert said["compared"] == 3
    assert {finding["where"] for finding in crossed} == {"records/nominal/img000002.json"}
    assert any("the depth differs" in finding["message"] for finding in crossed)


def test_pictures_are_counted_for_a_comparison_alone(described) -> None:
    with pytest.raises(InputError, match="cross_pictures is given without cross"):
        package.check(described, cross_pictures=1)


def test_without_blender_nothing_is_advised_that_check_does_not_have(described, monkeypatch) -> None:
    monkeypatch.setattr("spin_usd.processes.open_renderer.find_spec", lambda _: None)
    with pytest.raises(UnsupportedError, match=r"needs bpy, .* has it, or leave --cross out$"):
        package.check(described, cross=True)


def test_a_stage_is_not_crossed(small_stage) -> None:
    with pytest.raises(InputError, match="--cross is for those"):
        package.check(small_stage, cross=True)
