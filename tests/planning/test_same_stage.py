"""A stage in which ids of targets or parts have changed is another one: pictures that are there say the old ids."""

from pathlib import Path

import pytest

import spin_usd
from spin_usd.planning import orphans
from spin_usd.store.dataset_folder import Store
from tests.stage.read.test_numbering import write

LABELS = {"labels": "segmentation", "labels_only": True}


def test_a_stage_whose_parts_have_other_ids_is_another(tmp_path: Path) -> None:
    stage, out = write(tmp_path), tmp_path / "dataset"
    assert spin_usd.render(stage, out=out, **LABELS).made == 2
    parts = {part.path: number for number, part in spin_usd.Dataset(out).parts.items()}
    text = stage.read_text()
    stage.write_text(text.replace('def Cube "C" {}', 'def Cube "Aa" {}\n        def Cube "C" {}'))
    with pytest.raises(spin_usd.SpinError, match="differs in: ids of targets and parts"):
        spin_usd.render(stage, out=out, frames="0:1", **LABELS)
    assert {part.path: number for number, part in spin_usd.Dataset(out).parts.items()} == parts
    assert spin_usd.render(stage, out=out, replace=True, **LABELS).made == 2


def test_the_events_of_a_variant_go_with_its_last_picture(tmp_path: Path) -> None:
    stage, out = write(tmp_path), tmp_path / "dataset"
    spin_usd.render(stage, out=out, **LABELS)
    events = [out / "events" / name for name in ("nominal.h5", "nominal.json")]
    events[0].parent.mkdir()
    for path in events:
        path.write_text("of these pictures")
    orphans.remove(Store(root=out), [next(Store(root=out).records())])
    assert all(path.is_file() for path in events)
    stage.write_text(stage.read_text().replace('def Cube "C" {}', 'def Cube "Aa" {}\n        def Cube "C" {}'))
    assert spin_usd.render(stage, out=out, replace=True, **LABELS).made == 2
    assert not events[0].parent.exists()


def test_an_edit_that_renumbers_nothing_is_the_same_stage(tmp_path: Path) -> None:
    stage, out = write(tmp_path), tmp_path / "dataset"
    spin_usd.render(stage, out=out, **LABELS)
    stage.write_text(stage.read_text().replace("double size = 2.5", "double size = 2.25"))
    assert spin_usd.render(stage, out=out, **LABELS).made == 2


def test_nocs_of_a_target_that_loses_a_part_are_of_its_box_then(tmp_path: Path) -> None:
    """The box is the picture's own, which its record says; by that of dataset.json they would be somewhere else."""
    blinks = 'token visibility.timeSamples = { 0: "inherited", 1: "invisible" }\n            double size = 3'
    stage, out = write(tmp_path, blinks=blinks), tmp_path / "dataset"
    spin_usd.render(stage, out=out, labels=["nocs", "dense_pose", "instance"], labels_only=True)
    assert not {"nocs", "support"} & {finding.code for finding in spin_usd.check(out).findings}
    boxes = [picture.targets[0].box.tolist() for picture in spin_usd.Dataset(out)]
    assert boxes[0] != boxes[1]
