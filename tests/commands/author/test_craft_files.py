"""Craft from seeds as targets of `author`: labels of their parts, the same stage twice, both looks."""

from pathlib import Path

import numpy as np
import pytest

import spin_usd
from spin_usd.commands.author.in_child import author_stage
from spin_usd.craft.craft import KINDS
from spin_usd.craft.make_craft import CraftChoice, make_craft
from spin_usd.errors import InputError
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.composition.stage_hash import hash_and_files
from spin_usd.stage.read.stage_reader import StageReader

SAMPLE = "range=9 count=2"


def authored(out: Path, target: str, **options: object) -> Path:
    report = author_stage(sample=SAMPLE, target=target, camera="speedplus", resolution="120x75", out=out, **options)
    return Path(report.root)


def test_a_craft_of_a_seed_is_labelled_as_it_was_made(tmp_path: Path) -> None:
    root = authored(tmp_path / "stage", "craft:12")
    assert not [finding for finding in check_stage(root) if finding.severity == "error"]
    spin_usd.render(root, out=tmp_path / "set", renderer="raycast", labels="segmentation,dense_pose")
    dataset, craft = spin_usd.Dataset(tmp_path / "set"), make_craft(CraftChoice(seed=12))
    parts = {part.name: part.class_name for part in dataset.parts.values()}
    assert parts == {part.name: KINDS[part.kind] for part in craft.parts}
    low, high = np.min([p.bounds[0] for p in craft.parts], axis=0), np.max([p.bounds[1] for p in craft.parts], axis=0)
    for picture in dataset:
        seen = picture.dense_pose[picture.segmentation > 0]
        assert len(seen) > 50
        assert (seen >= low - 1e-5).all()
        assert (seen <= high + 1e-5).all()
        assert set(picture.keypoints.names) == set(craft.keypoints)


def test_the_same_seed_is_the_same_stage_and_another_is_another(tmp_path: Path) -> None:
    roots = [authored(tmp_path / name, f"craft:{seed}") for name, seed in (("a", 3), ("b", 3), ("c", 4))]
    one, same, other = (hash_and_files(StageReader(root).stage, root.parent)[0] for root in roots)
    assert one == same
    assert one != other


def test_a_file_and_a_further_body_can_be_craft_too(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('seed = 5\nfamily = "cubesat"\nsize = 0.3\n')
    root = authored(tmp_path / "stage", str(file), also=["craft:9:distance=3..4"])
    reader = StageReader(root)
    names = [body.target.name for body in reader.scene(reader.frames[0]).bodies]
    assert names == ["mine", "craft_9"]
    with pytest.raises(InputError, match="no seed"):
        authored(tmp_path / "no", "craft:x")
