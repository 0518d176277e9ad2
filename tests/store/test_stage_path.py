"""A stage may be given by its folder."""

import pytest

from spin_usd.errors import InputError
from spin_usd.store.stage_path import existing_stage, root_layer


def test_a_folder_means_the_root_layer_that_author_writes_into_it(tmp_path, small_stage, spin_usd) -> None:
    assert root_layer(small_stage.parent) == existing_stage(small_stage.parent) == small_stage
    assert root_layer(tmp_path) == tmp_path
    by_folder, by_file = (spin_usd("plan", each, "--labels-only") for each in (small_stage.parent, small_stage))
    assert by_folder.stdout.splitlines()[:2] == by_file.stdout.splitlines()[:2]


MORE = {"render": ["--out", "out"], "diff": ["nominal", "noisy_1"]}


@pytest.mark.parametrize("command", ["plan", "render", "measure", "diff"])
@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("gone.usda", "gone.usda: does not exist; check the path, or make a stage with spin-usd author"),
        ("dataset", "dataset: is a dataset, and a stage is expected; give its stage, dataset/stage"),
        ("folder", "folder: is a folder without a dataset.usda; give the stage's root layer"),
    ],
)
def test_what_is_not_a_stage_is_refused_by_every_command_alike(tmp_path, spin_usd, command, name, sentence) -> None:
    for folder in ("dataset", "folder"):
        (tmp_path / folder).mkdir()
    (tmp_path / "dataset" / "dataset.json").write_text("{}")
    refused = spin_usd(command, name, *MORE.get(command, []), cwd=tmp_path, code=2)
    assert refused.stderr.strip() == f"spin-usd: {sentence}"
    assert not (tmp_path / "out").exists()


def test_a_root_layer_in_a_folder_that_looks_like_a_dataset_is_a_stage(tmp_path) -> None:
    (tmp_path / "dataset.json").write_text("{}")
    (tmp_path / "dataset.usda").write_text("#usda 1.0\n")
    assert existing_stage(tmp_path) == tmp_path / "dataset.usda"
    with pytest.raises(InputError, match="does not exist"):
        existing_stage(tmp_path / "other.usda")
