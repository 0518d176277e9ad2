"""Tables that people write by hand: the same rows from JSON, CSV and TOML, and every mistake named by file and row."""

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.formats.table_file import read_keypoints_file, read_parts_file
from spin_usd.scene.name_rule import PartRule, Rules

POINTS = {
    "a.json": '{"tip": [0.1234567890123, 0, 1e-3], "nose": [1, 2, 3]}',
    "b.json": '[{"name": "tip", "x": 0.1234567890123, "y": 0, "z": 0.001}, {"z": 3, "name": "nose", "x": 1, "y": 2}]',
    "c.json": '{"tip": {"x": 0.1234567890123, "y": 0, "z": 0.001}, "nose": {"x": 1, "y": 2, "z": 3}}',
    "d.csv": "name,x,y,z\ntip, 0.1234567890123, 0, 1e-3\nnose,1,2,3\n",
    "e.csv": "\ufeffz,y,x,name\r\n0.001,0,0.1234567890123,tip\r\n3,2,1,nose\r\n",
    "f.toml": "tip = [0.1234567890123, 0, 1e-3]\nnose = {x = 1, y = 2, z = 3}\n",
}
PARTS = {
    "a.json": '{"cells*": ["panel", "solar"], "foil": {"part": "bus"}}',
    "b.json": '[{"pattern": "cells*", "part": "panel", "class": "solar"}, {"pattern": "foil", "part": "bus"}]',
    "c.csv": "pattern,part,class\ncells*,panel,solar\nfoil,bus,\n",
    "d.toml": '"cells*" = ["panel", "solar"]\nfoil = ["bus"]\n',
    "semicolons.csv": "part; pattern; class\npanel; cells*; solar\nbus; foil;\n",
    "tabs.csv": "pattern\tpart\tclass\ncells*\tpanel\tsolar\nfoil\tbus\n",
}


def written(folder, name, text):
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@pytest.mark.parametrize("name", POINTS)
def test_keypoints_are_the_same_in_every_form_to_the_last_bit(tmp_path, name) -> None:
    found = read_keypoints_file(written(tmp_path, name, POINTS[name]))
    assert found.names == ("tip", "nose")
    assert found.points.tolist() == [[0.1234567890123, 0, 0.001], [1, 2, 3]]
    assert found.points.dtype == np.float64


@pytest.mark.parametrize("name", PARTS)
def test_rules_are_the_same_in_every_form(tmp_path, name) -> None:
    panel = PartRule(pattern="cells*", part="panel", class_name="solar")
    assert read_parts_file(written(tmp_path, name, PARTS[name])) == (panel, PartRule(pattern="foil", part="bus"))


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.txt", "", "neither .json, .csv nor .toml"),
        ("a.json", "[", "is not JSON"),
        ("a.json", '"tip"', "holds no table"),
        ("a.json", "{}", "holds no name"),
        ("a.csv", "name,x,y,z\n", "holds no name"),
        ("a.json", '{"tip": [0, 0]}', "a.json, 'tip': is not a row of x, y, z; write {"),
        ("a.json", '{"tip": [0, 0, 1], "tip": [0, 0, 2]}', "has the key 'tip' twice"),
        ("a.csv", "name,x,y,z\ntip,0,0,1\ntip,0,0,2\n", "line 3: names 'tip' a second time"),
        ("a.csv", "name,x,y\ntip,0,0\n", "line 2: has no 'z'"),
        ("a.csv", "tip,0,0,1\nnose,0,0,2\n", "line 2: has no 'name'; give each row name, x, y, z"),
        ("a.csv", "name,x,y,z\ntip,0,0,1,5\n", "line 2: has 'a further column'"),
        ("a.csv", "name,x,y,z\ntip,0,zero,1\n", "line 2: has y = 'zero'"),
        ("a.json", '{"tip": [0, NaN, 1]}', "'tip': has y = nan"),
        ("a.json", '{"tip": [0, true, 1]}', "'tip': has y = True"),
        ("a.json", '{"tip": {"x": 0, "y": 0, "z": 1, "unit": "mm"}}', "has 'unit', which means nothing here"),
        ("a.json", '[{"name": 7, "x": 0, "y": 0, "z": 1}]', "entry 0: has the name 7"),
        ("a.toml", "tip = [0, 0", "is not TOML"),
        (
            "a.toml",
            '[[keypoint]]\nname = "tip"\nx = 0\ny = 0\nz = 1\n',
            r"a.toml, 'keypoint': is not a row of x, y, z; write \"NAME\" = \[x, y, z\], one such line for each name$",
        ),
    ],
)
def test_what_is_wrong_with_keypoints_is_said_with_where(tmp_path, name, text, sentence) -> None:
    with pytest.raises(InputError, match=sentence) as caught:
        read_keypoints_file(written(tmp_path, name, text))
    assert str(tmp_path / name) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("pattern,part,class\na,bus,x\nb,bus,y\n", "line 3: gives the part 'bus' the class 'y', and another row gives"),
        ("pattern,part\n,bus\n", "line 2: has no 'pattern'"),
        ("pattern,part\na,\n", "line 2: has no 'part'"),
        (f"pattern,part\na,{'x' * 256}\n", "give printable text of up to 255"),
    ],
)
def test_what_is_wrong_with_rules_is_said_with_where(tmp_path, text, sentence) -> None:
    with pytest.raises(InputError, match=sentence):
        read_parts_file(written(tmp_path, "parts.csv", text))


def test_all_rows_of_a_part_have_the_class_that_one_gives(tmp_path) -> None:
    rules = read_parts_file(written(tmp_path, "parts.csv", "pattern,part,class\na,bus,\nb,bus,body\n"))
    assert [rule.class_name for rule in rules] == ["body", "body"]


def test_the_first_rule_that_matches_counts_and_capitals_do_not() -> None:
    rules = [PartRule(pattern="Panel_?", part="one"), PartRule(pattern="*", part="rest")]
    assert [Rules(rules).first(names).part for names in (["x", "Panel_1"], ["pANEL_1"])] == ["one"] * 2
    assert Rules(rules).first(["panel_12"]).part == "rest"
    assert Rules(rules[:1]).first(["panel_12"]) is None
