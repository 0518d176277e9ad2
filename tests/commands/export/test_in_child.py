"""The card says what the pictures are like, in numbers that can be counted by hand."""

import re

import numpy as np
from PIL import Image

from spin_usd.commands.export.in_child import BANDS, SECTORS, views
from tests.exchange.conftest import clone, write_export

QUARTER = [0.5**0.5, 0.5**0.5, 0.0, 0.0]  # a quarter turn about x


def test_counts_and_statistics(rendered, tmp_path) -> None:
    """Ranges 3, 4 and 8 m straight ahead, all turned by 90 degrees; two variants of each."""
    pictures = [
        {"frame": f"f{z}", "variant": variant, "index": z, "q": QUARTER, "t": [0.0, 0.0, float(z)]}
        for variant in ("nominal", "dim")
        for z in (3, 4, 8)
    ]
    dataset = clone(rendered, tmp_path / "dataset", pictures)
    write_export(dataset, "speedplus", tmp_path / "out", split="train=0.67,validation=0.33")
    card = (tmp_path / "out" / "README.md").read_text()
    assert "# tango, 6 pictures as speedplus" in card
    counts = dict(re.findall(r"^\| (\w+ \| \w+) \| (\d+) \|$", card, re.MULTILINE))
    assert counts == {
        "train | nominal": "2",
        "train | dim": "2",
        "validation | nominal": "1",
        "validation | dim": "1",
    }
    assert "| range of the target, m | 3 | 4 | 5 | 8 |" in card
    assert "| rotation from body axes to camera axes, degrees | 90 | 90 | 90 | 90 |" in card
    assert f"from 1 of {BANDS * SECTORS} cells" in card
    assert "Not stated: the owner of the pictures writes it here." in card
    assert np.asarray(Image.open(tmp_path / "out" / "contact_sheet.jpg")).shape[2] == 3


def test_the_sun_s_angle_and_the_visible_fraction_are_those_of_the_records(rendered, tmp_path) -> None:
    write_export(rendered, "speedplus", tmp_path / "out")
    card = (tmp_path / "out" / "README.md").read_text()
    from spin_usd.reading.dataset import Dataset

    pictures = list(Dataset(rendered))
    angles = []
    for picture in pictures:
        back = -picture.t_cam_body / np.linalg.norm(picture.t_cam_body)
        angles.append(np.degrees(np.arccos(np.dot(picture.record["sun"]["towards_cam"], back))))
    fractions = [picture.targets[0].visible_fraction for picture in pictures]
    for words, numbers in (
        ("Sun to camera as seen from the target, degrees", angles),
        ("visible fraction of the target", fractions),
    ):
        (row,) = re.findall(rf"^\| {words} \| (\S+) \| \S+ \| (\S+) \| (\S+) \|$", card, re.MULTILINE)
        expected = (np.min(numbers), np.mean(numbers), np.max(numbers))
        assert np.allclose([float(each) for each in row], expected, rtol=1e-3)


def test_views_from_all_around_fill_all_cells() -> None:
    """Directions spread evenly, by the golden angle, meet every cell of equal area."""
    from array import array

    count = 2000
    height = 1 - (2 * np.arange(count) + 1) / count
    azimuth = np.degrees(np.mod(np.arange(count) * np.pi * (3 - 5**0.5), 2 * np.pi)) - 180
    columns = {"height": array("d", height), "azimuth": array("d", azimuth)}
    assert views(columns).startswith(f"The camera sees the target from {BANDS * SECTORS} of {BANDS * SECTORS}")
