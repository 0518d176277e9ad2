"""The preset of fits: light of walls alone, and no light at all."""

import math
import re
import tomllib

import pytest
from pxr import Sdf

from spin_usd.commands.gap.report import GapLight, GapPicture, GapReport
from spin_usd.commands.gap.write_preset import write_preset
from spin_usd.errors import InputError
from spin_usd.scene.sensor import Sensor

ROUNDED = 1e-3  # relative, of four digits


def report(*lights):
    """A report of pictures that have one list of lights each, by name and share."""
    pictures = [
        GapPicture(
            name=f"img{number}", real={}, ours={}, fitted={}, silhouette={}, notes=[],
            lights=[
                GapLight(name=name, strength=10 * share, interval=[0, 20], share=share, direction=[0, 0, 1], distance=4)
                for name, share in each
            ],
        )
        for number, each in enumerate(lights)
    ]  # fmt: skip
    return GapReport(
        real="real", stage="stage", pictures=pictures, parts={}, summary={}, fits={}, left_out={}, seconds=0, notes=[]
    )


def test_a_wall_counts_where_nothing_else_shines(tmp_path) -> None:
    found = report([("Wall000", 0.9), ("Panel001", 0.1)], [("Wall001", 1.0)])
    write_preset(tmp_path / "bed.usda", found, Sensor(), [])
    drawn = (tmp_path / "bed.toml").read_text()
    assert '"sun.irradiance" = { distribution = "choice", values = [1.9, 9.1]' in drawn  # brought to the central ones


def test_no_light_makes_no_preset(tmp_path) -> None:
    with pytest.raises(InputError, match="no picture has light of which a preset could be made"):
        write_preset(tmp_path / "bed.usda", report([], []), Sensor(), [])
    assert not list(tmp_path.iterdir())


def test_any_file_name_makes_an_augmentation_and_a_preset_that_are_read(tmp_path) -> None:
    path = tmp_path / 'mein "Bett"-\u00e9 {2}.usda'
    write_preset(path, report([("Sun001", 1.0)]), Sensor(), [])
    assert Sdf.Layer.FindOrOpen(str(path)).GetPrimAtPath("/World/Lights/Sun")
    (name,) = re.findall('name = "(.*)"', path.with_suffix(".toml").read_text())
    assert re.fullmatch("[a-z0-9_]+", name)


def test_a_light_is_drawn_with_its_strength_and_its_room(tmp_path) -> None:
    found = report([("Panel001", 0.6), ("Wall000", 0.4)], [("Sun001", 0.6)], [("Sun002", 0.6), ("Wall001", 0.1)])
    write_preset(tmp_path / "bed.usda", found, Sensor(), [])
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "bed.usda"))
    room = layer.GetPrimAtPath("/World/Lights/Room")
    assert room.attributes["inputs:intensity"].default == pytest.approx(math.pi / 4 * (4 + 0 + 1) / 3 / 6, rel=ROUNDED)
    drawn = tomllib.loads((tmp_path / "bed.toml").read_text())["augmentation"][0]["sample"]
    assert drawn["fill.factor"]["values"] == pytest.approx([2.4, 0, 0.6])
    assert {name: words.get("together") for name, words in drawn.items()} == {
        "sun.direction": None,
        "sun.irradiance": "sun.direction",
        "fill.factor": "sun.direction",
    }


def test_the_sun_is_brighter_than_the_room_whatever_the_fits(tmp_path) -> None:
    walls = [(f"Wall00{number}", 6.0) for number in range(6)]
    write_preset(tmp_path / "bed.usda", report([("Sun001", 0.2)], [("Sun002", 0.3), *walls]), Sensor(), [])
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "bed.usda"))
    sun, room = (layer.GetAttributeAtPath(f"/World/Lights/{each}.inputs:intensity").default for each in ("Sun", "Room"))
    assert sun > room > 0
