"""A stage may be given by its folder."""

from spin_usd.dataset.store.stage_path import root_layer


def test_a_folder_means_the_root_layer_that_author_writes_into_it(tmp_path, small_stage, spin_usd) -> None:
    assert root_layer(small_stage.parent) == small_stage
    assert root_layer(tmp_path) == tmp_path
    by_folder, by_file = (spin_usd("plan", each, "--labels-only") for each in (small_stage.parent, small_stage))
    assert by_folder.stdout.splitlines()[:2] == by_file.stdout.splitlines()[:2]
