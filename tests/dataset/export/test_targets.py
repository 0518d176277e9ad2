"""Of several targets a format of one holds the first, or the one that is asked for: its poses, its masks, its boxes."""

import csv
import json

import numpy as np
import pytest
import trimesh
from PIL import Image

from spin_usd import Dataset
from spin_usd.errors import InputError
from tests.dataset.export.conftest import write_export

CAMERA = {"Nu": 96, "Nv": 72, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[130, 0, 48], [0, 130, 36], [0, 0, 1]]}
OUT = (9, 0, 6)  # metres: beside the frame
PLACES: dict[str, list[tuple[float, float, float]]] = {"craft": [(0, 0, 6), (0, 0.1, 6)], "debris": [(0.4, 0, 5), OUT]}


@pytest.fixture(scope="module")
def two(tmp_path_factory, spin_usd):
    """A box, and a smaller one before it, which the second picture does not show."""
    folder = tmp_path_factory.mktemp("two_targets")
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    for name, places in PLACES.items():
        trimesh.creation.box((1, 0.8, 0.6) if name == "craft" else (0.4, 0.4, 0.4)).export(folder / f"{name}.stl")
        entries = [
            {"filename": f"p{i}.png", "q_vbs2tango_true": [0.8, 0.36, 0.48, 0], "r_Vo2To_vbs_true": list(place)}
            for i, place in enumerate(places)
        ]
        (folder / f"{name}.json").write_text(json.dumps(entries))
    models = ("--target", folder / "craft.stl", "--also", f"{folder / 'debris.stl'}:{folder / 'debris.json'}")
    chosen = ("--poses", folder / "craft.json", *models, "--camera", folder / "camera.json", "--units-per-metre", 1)
    spin_usd("author", *chosen, "--out", folder / "stage")
    spin_usd("render", folder / "stage", "--out", folder / "dataset", "--renderer", "raycast", "--samples", 1)
    return folder / "dataset"


@pytest.mark.parametrize("target", PLACES)
def test_poses_and_masks_are_of_the_target_asked_for(two, tmp_path, target) -> None:
    write_export(two, "speedplus", tmp_path / "out", target=target)
    entries = json.loads((tmp_path / "out" / "synthetic" / "train.json").read_text())
    assert np.allclose([entry["r_Vo2To_vbs_true"] for entry in entries], PLACES[target], atol=1e-9)
    for picture in Dataset(two):
        mask = np.asarray(Image.open(tmp_path / "out" / "synthetic" / "masks" / f"{picture.frame}.png"))
        number = {each.name: each.id for each in picture.targets}[target]
        assert np.array_equal(mask > 0, picture.label("instance") == number)


def test_the_first_is_taken_if_none_is_named(two, tmp_path) -> None:
    write_export(two, "speedplus", tmp_path / "out")
    assert json.loads((tmp_path / "out" / "export.json").read_text())["target"] == "craft"
    with pytest.raises(InputError, match="has no target 'moon'; choose among craft, debris"):
        write_export(two, "speedplus", tmp_path / "other", target="moon")


def test_pictures_without_the_target_have_no_box(two, tmp_path) -> None:
    report = write_export(
        two, "spark", tmp_path / "out", target="debris", options={"layout": "2022-stream1", "depth": "none"}
    )
    assert (report.pictures, report.left_out) == (1, 1)
    with (tmp_path / "out" / "train.csv").open() as file:
        (row,) = csv.DictReader(file)
    x0, y0, x1, y1 = Dataset(two).picture("p0").targets[1].box_visible.astype(int).tolist()
    assert row == {"filename": "p0.png", "class": "debris", "bbox": f"[{y0}, {x0}, {y1}, {x1}]"}
