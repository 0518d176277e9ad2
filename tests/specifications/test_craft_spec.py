"""What a user's craft is: seeds, ranges of seeds, and craft.toml."""

from pathlib import Path

import pytest

from spin_usd.craft.equipment import EQUIPMENT
from spin_usd.craft.make_craft import CraftChoice
from spin_usd.errors import InputError
from spin_usd.specifications.craft_spec import craft_choices, is_craft


def test_seeds_and_ranges_of_them() -> None:
    assert craft_choices("craft:7") == (CraftChoice(seed=7),)
    assert [each.seed for each in craft_choices("craft:0..3")] == [0, 1, 2, 3]
    assert [is_craft(each) for each in ("craft:7", "dir/a.toml", "tango")] == [True, True, False]


@pytest.mark.parametrize("text", ["craft:", "craft:-1", "craft:x", "craft:3..1", "craft:0..1000", f"craft:{2**63}"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="seed"):
        craft_choices(text)


def test_a_file_can_count_all_equipment(tmp_path: Path) -> None:
    file, counts = tmp_path / "craft.toml", {key: number for number, key in enumerate(EQUIPMENT)}
    file.write_text("".join(f"{key} = {count}\n" for key, count in counts.items()))
    assert craft_choices(str(file)) == (CraftChoice(counts=counts),)


def test_a_file_decides_what_it_names(tmp_path: Path) -> None:
    file = tmp_path / "craft.toml"
    file.write_text('seed = 5.0\nfamily = "box"\nsize = 2\nfinish = "gold_foil"\nwings = 2\ndishes = 1\n')
    (found,) = craft_choices(str(file))
    assert found == CraftChoice(seed=5, family="box", size=2.0, finish="gold_foil", wings=2, counts={"dishes": 1})


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("wings = 3", "wings"),
        ('wings = "two"', "wings: 'two' is not a whole number"),
        ("wings = 1.5", "craft.toml: wings: 1.5 is not a whole number"),
        ("wings = 0\npanels = 3", "wings: 0 contradicts panels"),
        ("wings = 0\ndriven = true", "wings: 0 contradicts driven"),
        ('size = "1.6"', "size: '1.6' is not a number"),
        ("driven = 1", "driven: 1 is not true or false"),
        ("wigns = 2", "there is no 'wigns'; is wings meant"),
        ("dishs = 2", "there is no 'dishs'; is dishes meant"),
        ("wheels = 4", "there is no 'wheels'; choose among seed, family, .*, handles, cables"),
        ('family = "saucer"', "saucer"),
        ('finish = "wood"', "wood"),
        ("sice = 2", "sice"),
        ("size = nan", "size"),
        ("dishes = -1", "craft.toml: dishes: "),
        ("cables = 21", "craft.toml: cables: "),
        ("seed = [", "TOML"),
    ],
)
def test_a_fault_in_a_file_is_named(tmp_path: Path, text: str, found: str) -> None:
    file = tmp_path / "craft.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=found):
        craft_choices(str(file))
