"""Specifications: those that travel along, the schema beside the registry, and what is wrong in a file."""

import json
import runpy

import pytest

from spin_usd.errors import InputError
from spin_usd.specifications.augmentation_spec import read_augmentation_spec
from tests.conftest import REPOSITORY

SHIPPED = sorted((REPOSITORY / "stages" / "augmentations").glob("*.toml"))
GROUPS = ("camera", "environment", "materials")
GOOD = """
schema = "augment-1"
[[augmentation]]
name = "a"
"""


def read(tmp_path, text):
    (tmp_path / "spec.toml").write_text(text)
    return read_augmentation_spec(tmp_path / "spec.toml")


def test_the_schemas_are_what_types_and_registry_say() -> None:
    built = dict(runpy.run_path(str(REPOSITORY / "tools" / "build_spec_schema"))["texts"]())
    assert sorted(built) == ["augment-1.schema.json", "sample-1.schema.json"]
    for name, text in built.items():
        assert text == (REPOSITORY / "schemas" / name).read_text()


def test_every_parameter_has_a_description_and_its_units_there() -> None:
    sample = json.loads((REPOSITORY / "schemas" / "augment-1.schema.json").read_text())["$defs"]["sample"]
    assert all(len(each["description"]) > 10 for each in sample["properties"].values())
    assert sample["properties"]["sun.irradiance"]["properties"]["unit"]["enum"] == ["W/m2", "kW/m2"]
    assert "unit" not in sample["properties"]["optics.glare"]["properties"]


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_those_that_travel_along_are_valid_and_name_their_schema(path) -> None:
    specification = read_augmentation_spec(path)
    assert specification.name == path.stem
    first = path.read_text().splitlines()[0]
    assert first.startswith("#:schema ")
    assert (path.parent / first.removeprefix("#:schema ")).is_file()


def test_the_ablation_has_its_eight_cells() -> None:
    cells = [read_augmentation_spec(path).augmentations for path in SHIPPED if path.stem.startswith("ablation")]
    assert len({tuple(one.select[group] for group in GROUPS) for (one,) in cells}) == 8
    for (one,) in cells:
        rich = [group for group in GROUPS if one.select[group] == "rich"]
        assert one.name == "ablation_" + ("_".join(rich) or "none")


def test_a_count_numbers_the_names(tmp_path) -> None:
    assert [a.name for a in read(tmp_path, GOOD + "count = 3").augmentations] == ["a_1", "a_2", "a_3"]
    assert [a.name for a in read(tmp_path, GOOD + "count = 1.0").augmentations] == ["a_1"]
    assert [a.name for a in read(tmp_path, GOOD).augmentations] == ["a"]


def test_words_unit_and_per_are_reported_apart(tmp_path) -> None:
    text = '[augmentation.sample]\n"sun.factor" = { distribution = "uniform", low = 1, high = 2, per = "frame" }'
    ((entry,),) = (a.sample for a in read(tmp_path, GOOD + text).augmentations)
    assert (entry.parameter, entry.per_frame, entry.unit) == ("sun.factor", True, None)
    assert entry.words == {"distribution": "uniform", "low": 1, "high": 2}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("schema = ", "is not TOML"),
        ('schema = "augment-1"', "'augmentation' is missing"),
        (GOOD.replace("augment-1", "augment-2"), "schema: 'augment-1' was expected"),
        (GOOD + 'color = "red"', r"augmentation\[0\]: there is no 'color'"),
        (GOOD.replace('"a"', '"A b"'), r"augmentation\[0\].name: 'A b' does not match"),
        (GOOD + "count = 0", r"augmentation\[0\].count: 0 is less than"),
        (GOOD + '[[augmentation]]\nname = "a"', "two augmentations are named 'a'"),
        (GOOD.replace('"a"', '"nominal"'), "'nominal' is the name of the stage without"),
        (GOOD.replace('"a"', '"all"'), "'all' is the name of every variant"),
        (GOOD.replace('"a"', f'"{"a" * 300}"'), "name has 300 characters: aaaaaaaaaaaaaaaaaaaa...; take 100"),
        (GOOD + "constraints = { sun_far_deg = 3 }", "constraints: there is no 'sun_far_deg'"),
        (
            GOOD + 'sample = { "sun.factor" = { distribution = "fixed", value = {} } }',
            r"sample.sun.factor.value: fits none of its forms: {} is not of type 'boolean', 'number', 'string'",
        ),
        (
            GOOD + 'sample = { "sun.colour" = { distribution = "fixed", value = 1 } }',
            r"sample: there is no 'sun.colour'; is sun.factor meant\? spin-usd augment --list shows all",
        ),
        (
            GOOD + 'sample = { "material.A.ruffness" = { distribution = "fixed", value = 1 } }',
            r"sample: there is no 'material.A.ruffness'; is material.A.roughness meant\?",
        ),
        *(
            (
                GOOD + f'sample = {{ "part.Bus.{field}" = {{ distribution = "fixed", value = 1 }} }}',
                rf"sample: there is no 'part.Bus.{field}'; {near}spin-usd augment --list shows all",
            )
            for field, near in (
                ("bulge", r"is part.Bus.bulged meant\? "),
                ("shift", r"is part.Bus.shift.x meant\? "),
                ("turned", r"is part.Bus.turn meant\? "),
                ("qqq", ""),
            )
        ),
        (
            GOOD + 'sample = { "exposure.time" = { distribution = "fixed", value = 1, unit = "px" } }',
            r"sample.exposure.time.unit: 'px' is not one of \['s', 'ms', 'us'\]",
        ),
        (
            GOOD + 'sample = { "exposure.time" = { distribution = "fixed", value = 1 } }',
            'sample.exposure.time: \'unit\' is missing: add unit = "s" or "ms" or "us"',
        ),
        (
            GOOD + 'sample = { "lens.fx" = { distribution = "fixed", value = 1, unit = "px", per = "frame" } }',
            r"sample.lens.fx.per: 'frame' is not one of \['augmentation'\]",
        ),
    ],
)
def test_what_is_wrong_is_named_by_its_key(tmp_path, text, sentence) -> None:
    with pytest.raises(InputError, match=sentence) as caught:
        read(tmp_path, text)
    assert len(str(caught.value)) < 600


def test_what_is_taken_in_turn_is_another_for_each(tmp_path) -> None:
    text = """
count = 3
select = { camera = ["plain", "rich"], materials = "rich" }
[augmentation.sample]
"optics.glare" = { distribution = "in_turn", values = [0.01, 0.02] }
"""
    made = read(tmp_path, GOOD + text).augmentations
    assert [one.select for one in made] == [{"camera": c, "materials": "rich"} for c in ("plain", "rich", "plain")]
    assert [one.sample[0].words for one in made] == [{"distribution": "fixed", "value": v} for v in (0.01, 0.02, 0.01)]


def test_pictures_take_nothing_in_turn(tmp_path) -> None:
    text = '[augmentation.sample]\n"optics.glare" = { distribution = "in_turn", values = [0.01], per = "frame" }'
    with pytest.raises(InputError, match=r"sample\.optics\.glare\.per: 'augmentation' was expected"):
        read(tmp_path, GOOD + text)


def test_the_published_augmentation_differs_in_materials_and_background(tmp_path) -> None:
    made = read_augmentation_spec(REPOSITORY / "stages" / "augmentations" / "isda.toml").augmentations
    assert len(made) == 3
    assert {one.select["materials"] for one in made} == {"plain", "rich"}
    assert len({s.words["value"] for one in made for s in one.sample if s.parameter == "background"}) == 3
