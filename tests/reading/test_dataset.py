"""Datasets as users read them: found without opening a record, in any process, and refused with reasons."""

import json
import multiprocessing
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest

from spin_usd.commands.reproduce.run import reproduce_picture
from spin_usd.errors import InputError
from spin_usd.reading.dataset import Dataset


@pytest.fixture
def many(rendered, tmp_path):
    """A dataset of two variants of a hundred frames, whose records are empty files."""
    shutil.copy(rendered / "dataset.json", tmp_path)
    for variant in ("noisy", "nominal"):
        folder = tmp_path / "records" / variant
        folder.mkdir(parents=True)
        for number in range(100):
            (folder / f"img{number:03}.json").touch()
    return tmp_path


def checksum(picture) -> tuple[str, str, int]:
    return picture.frame, picture.variant, int(picture.segmentation.sum())


def test_pictures_are_found_by_place_by_name_and_in_a_loop(rendered) -> None:
    dataset = Dataset(rendered)
    frames = [path.stem for path in sorted((rendered / "records" / "nominal").iterdir())]
    assert len(dataset) == len(frames) == 3
    assert [picture.frame for picture in dataset] == frames
    assert dataset[np.int64(1)].frame == dataset[1 - len(frames)].frame == frames[1]
    assert dataset.picture(frames[2]).record == dataset[2].record == dataset[2:][0].record
    with pytest.raises(IndexError):
        dataset[len(frames)]


def test_no_record_is_opened_before_its_picture_is_asked_for(many) -> None:
    dataset = Dataset(str(many))
    assert len(dataset) == 200
    assert dataset.names[:2] == (("img000", "noisy"), ("img001", "noisy"))
    assert dataset.variants == ("noisy", "nominal")
    with pytest.raises(InputError, match=r"noisy/img000.json: is not JSON"):
        dataset[0]


def test_a_variant_is_a_dataset_of_its_own(many) -> None:
    nominal = Dataset(many).of_variant("nominal")
    assert len(nominal) == 100
    assert set(nominal.names) == {(f"img{number:03}", "nominal") for number in range(100)}
    assert len(nominal[10:].of_variant("nominal")) == 90
    assert nominal.parts == Dataset(many).parts
    with pytest.raises(InputError, match="no picture of variant 'noisy'; choose among the variants nominal"):
        nominal.of_variant("noisy")
    with pytest.raises(InputError, match="no picture 'img000' in variant 'noisy'"):
        nominal.picture("img000", "noisy")


def test_other_processes_read_the_same_pictures(rendered) -> None:
    dataset = Dataset(rendered)
    here = [checksum(picture) for picture in dataset]
    assert [checksum(picture) for picture in pickle.loads(pickle.dumps(dataset))] == here
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.map(checksum, list(dataset)) == here


def test_what_is_no_dataset_is_refused_with_what_to_do(rendered, tmp_path) -> None:
    with pytest.raises(InputError, match=r"is not a dataset: it has no dataset.json; give the folder that spin-usd"):
        Dataset(tmp_path)
    (tmp_path / "dataset.json").write_text(json.dumps({"schema": "dataset-1"}))
    with pytest.raises(InputError, match="breaks schema dataset-1"):
        Dataset(tmp_path)
    with pytest.raises(InputError, match="no picture 'none' in variant 'nominal'; pictures are named like img000001"):
        Dataset(rendered).picture("none")


def test_the_file_in_place_of_its_folder_is_refused(rendered) -> None:
    with pytest.raises(InputError, match=r"dataset.json: is a file; give its folder"):
        Dataset(rendered / "dataset.json")


def test_what_cannot_be_reproduced_is_refused_as_a_look_up_is(rendered, tmp_path) -> None:
    with pytest.raises(InputError, match=r"is not a dataset: it has no dataset.json"):
        reproduce_picture(tmp_path, "img000001")
    with pytest.raises(InputError, match="no picture 'img000001' in variant 'dim'; choose among the variants nominal"):
        reproduce_picture(rendered, "img000001", variant="dim")


WRONG = {
    "a name for a place": (lambda d: d["img000001"], r"there is no picture 'img000001'; give its place, from 0, or"),
    "names for a slice": (lambda d: d["a":"b"], "there is no picture slice"),
    "a number for a condition": (lambda d: d.where(3), '3 is not a condition; write it like "range < 8'),
    "a text for a share": (lambda d: d.split(0.5, "a"), r"the shares \(0.5, 'a'\) are invalid; give numbers"),
    "a share of nothing": (
        lambda d: d.split(0.9, 0.1),
        "0.1 of 3 poses is less than one; give larger",
    ),
    "a batch of nothing": (lambda d: d.collate([]), "there is no picture to make a batch of; give one or more"),
    "no such target": (lambda d: d.crop("nosuch"), "no target is named 'nosuch'; choose among 1 'tango'"),
    "no such id": (lambda d: d.crop(2), "there is no target 2; choose among 1 'tango'"),
    "no size": (lambda d: d.crop(size=0), "pictures cannot be of size 0; give one side"),
    "a size of text": (lambda d: d.resize("big"), "pictures cannot be of size 'big'; give one side"),
    "no margin": (lambda d: d.crop(margin="0.1"), "crops cannot have the margin '0.1'; give a share"),
}


@pytest.mark.parametrize(("ask", "words"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_asked_of_a_dataset_is_said_at_once(ask, words, rendered) -> None:
    with pytest.raises(InputError, match=words):
        ask(Dataset(rendered))


def test_a_picture_is_found_in_its_dataset(rendered) -> None:
    dataset = Dataset(rendered)
    assert dataset[1] == dataset[1] != dataset[0]
    assert dataset.index(dataset[1]) == 1
    assert dataset[0] not in dataset[1:]
    assert len({dataset[0], dataset[0]}) == 1


def test_its_text_is_one_line(rendered) -> None:
    assert repr(Dataset(rendered)[:1]).endswith("1 picture, variants: nominal)")
    assert repr(Dataset(rendered)[0]) == f"Picture('img000001' of 'nominal', in '{rendered}')"


def test_geometry_stays_read_only_in_another_process(rendered) -> None:
    picture = pickle.loads(pickle.dumps(Dataset(rendered)[0]))
    assert not picture.T_cam_body.flags.writeable
    assert not picture.keypoints.points.flags.writeable


def test_arrays_that_were_read_are_not_pickled(rendered) -> None:
    picture = Dataset(rendered)[0]
    before = len(pickle.dumps(picture))
    segmentation = picture.segmentation
    assert len(pickle.dumps(picture)) == before
    assert np.array_equal(pickle.loads(pickle.dumps(picture)).segmentation, segmentation)


def test_a_relative_path_outlives_a_change_of_folder(rendered, monkeypatch) -> None:
    monkeypatch.chdir(rendered.parent)
    dataset = Dataset(Path(rendered.name))
    monkeypatch.chdir("/")
    assert dataset[0].segmentation.any()


def test_what_was_not_asked_for_is_not_read(rendered, tmp_path) -> None:
    """As little is read where the other files are gone, in another process too, of crops, and of what is chosen."""
    folder = shutil.copytree(rendered, tmp_path / "dataset")
    for kind in ("depth", "image"):
        shutil.rmtree(folder / kind)
    dataset = Dataset(folder, labels=["segmentation"])
    assert dataset.collate([*dataset])["segmentation"].shape == (3, *dataset[0].segmentation.shape)
    assert "image" not in dataset.collate([*dataset])
    for part in (dataset[:1], dataset.where("index == 0"), dataset.resize(32), pickle.loads(pickle.dumps(dataset))):
        assert list(part[0].files) == ["segmentation"]
        assert part[0].mask(1).any()
    with pytest.raises(InputError, match=r"has no depth; .*open the dataset with depth among its labels"):
        _ = dataset[0].depth
    assert Dataset(rendered, labels="depth").collate(Dataset(rendered, labels="depth")[:2])["depth"].shape[0] == 2
    assert dataset[0].record == Dataset(rendered)[0].record


def test_a_label_that_pictures_lack_is_refused_when_the_dataset_is_opened(rendered) -> None:
    with pytest.raises(InputError, match=r"has no label 'flow'; choose among .*image.*, or render it too"):
        Dataset(rendered, labels=["image", "flow"])
