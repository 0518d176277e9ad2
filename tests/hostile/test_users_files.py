"""Files of the user's stay: no name that looks like ours makes one of them ours."""

import pytest


@pytest.mark.parametrize("stage", ["st/dataset.usda", "st/broken.usda"])
def test_a_render_into_a_folder_with_a_work_folder_of_the_users(place, spin_usd, stage) -> None:
    (place.stage / "broken.usda").write_text("no stage")
    (place.folder / "u" / ".work").mkdir(parents=True)
    (place.folder / "u" / ".work" / "t").write_text("thesis")
    refused = spin_usd("render", stage, "--renderer", "raycast", "--out", "u", cwd=place.folder, code=2)
    assert (place.folder / "u" / ".work" / "t").read_text() == "thesis"
    assert refused.stderr.count("\n") == 1


def test_a_render_into_a_dataset_with_names_like_temporary_ones(place, spin_usd) -> None:
    users = ("notes.tmp-draft.txt", "my/stuff/x.tmp-1", "a.tmp-dir/x", "image/nominal/b.tmp-2", "stage.tmp-old/x")
    for name in users:
        (place.dataset / name).parent.mkdir(parents=True, exist_ok=True)
        (place.dataset / name).write_text("x")
    spin_usd(*place.render(), cwd=place.folder)
    assert [(place.dataset / name).read_text() for name in users] == ["x"] * len(users)


def test_author_beside_a_hidden_folder_of_its_own_names_form(place, spin_usd) -> None:
    hidden = place.folder / ".out.20251122.bak"
    hidden.mkdir()
    (hidden / "t").write_text("thesis")
    spin_usd(*place.author(), cwd=place.folder)
    assert (hidden / "t").read_text() == "thesis"
    assert sorted(p.name for p in place.folder.iterdir() if p.name.startswith(".")) == [hidden.name]
