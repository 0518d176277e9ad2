"""Files of models are told by how they begin, whatever they are called."""

from pathlib import Path

import pytest

from spin_usd.commands.author.model import HEADS, USD_SUFFIXES, model_file
from spin_usd.errors import InputError
from spin_usd.formats.mesh.mesh_file import MESHES
from spin_usd.scene.name_rule import PartRule
from spin_usd.specifications.background_choice import images_in


@pytest.mark.parametrize("suffix", sorted({*MESHES, *USD_SUFFIXES}))
def test_a_pointer_of_git_lfs_is_told_in_every_format(tmp_path: Path, shared: Path, suffix: str) -> None:
    (tmp_path / f"craft{suffix}").write_bytes((shared / "data" / "strangers" / "lfs_pointer.txt").read_bytes())
    with pytest.raises(InputError, match=rf"craft{suffix}: is a pointer of Git LFS.*; run git lfs pull"):
        model_file(str(tmp_path / f"craft{suffix}"))


@pytest.mark.parametrize("head", HEADS, ids=lambda head: head[0].decode()[:8])
def test_a_file_of_another_format_than_its_name_says_is_told_its_name(tmp_path: Path, head) -> None:
    begins, what, suffixes = head
    (tmp_path / "craft.obj").write_bytes(begins + b" and more")
    with pytest.raises(InputError, match=f"is {what}"):
        model_file(str(tmp_path / "craft.obj"))
    for suffix in suffixes:
        (tmp_path / f"craft{suffix}").write_bytes(begins + b" and more")
        assert model_file(str(tmp_path / f"craft{suffix}")).suffix == suffix


def test_what_macos_and_windows_put_beside_photographs_is_passed_over(tmp_path: Path) -> None:
    for name in ("b.JPG", "a.jpg", "._a.jpg", ".DS_Store", "Thumbs.db"):
        (tmp_path / name).write_bytes(b"x")
    assert [file.name for file in images_in(tmp_path, "picture")] == ["a.jpg", "b.JPG"]


def test_a_pattern_that_is_a_name_matches_it() -> None:
    assert PartRule(pattern="Panel[1]", part="p").matches(["panel[1]"])
    assert PartRule(pattern="Panel[1]", part="p").matches(["Panel1"])
    assert not PartRule(pattern="Panel[1]", part="p").matches(["Panel[2]"])
