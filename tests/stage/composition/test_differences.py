"""Differences between compositions. The law: a difference applied to one of them is gone."""

import pytest

from spin_usd.stage.composition.differences import differences
from spin_usd.stage.composition.open_stage import open_stage

ROOT = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "World" (
    prepend variantSets = ["augmentation", "paint"]
)
{
    def Xform "Model" (
        prepend references = @./model.usda@
    )
    {
    }
    def Xform "Copies"
    {
        def Xform "A" (
            instanceable = true
            prepend references = @./model.usda@
        )
        {
        }
    }

    variantSet "augmentation" = {
        "a" (
            variants = {
                string paint = "thick"
            }
        )
        {
            VARIANT
        }
        "same" {
            over "Model" (
                doc = "Another comment."
            )
            {
                double size = 3
                asset texture = @./textures/../textures/paint.png@
            }
        }
    }
    variantSet "paint" = {
        "thick" {
            over "Model"
            {
                double coat = 2
            }
        }
    }
}
"""
MODEL = """#usda 1.0
(
    defaultPrim = "Model"
)

def Xform "Model" (
    prepend apiSchemas = ["MaterialBindingAPI"]
    kind = "component"
)
{
    double size = 3
    float share = 0.1
    int[] numbers = [1, 2, 3, 4, 5, 6]
    asset texture = @./textures/paint.png@
    double speed.timeSamples = {
        0: 1,
        1: 2,
        2: 3,
    }
    rel friend = </Model/Part>
    double follows.connect = </Model/Part.size>
    def Cube "Part"
    {
        double size = 1
        def Sphere "Ball"
        {
        }
    }
}
"""


@pytest.fixture
def make(tmp_path):
    """The root layer of a stage whose augmentation "a" holds `text`."""
    (tmp_path / "textures").mkdir()
    for name in ("paint", "copy", "rust"):
        (tmp_path / "textures" / f"{name}.png").write_bytes(b"rust" if name == "rust" else b"paint")
    (tmp_path / "model.usda").write_text(MODEL)

    def write(text=""):
        path = tmp_path / "root.usda"
        path.write_text(ROOT.replace("VARIANT", text))
        return path

    return write


@pytest.fixture
def found(make):
    """The differences from nominal to "a", without those of its paint, by kind and place."""

    def find(text):
        path = make(text)
        a, b = open_stage(path, selections={"paint": "thick"}), open_stage(path, variant="a")
        listed = list(differences(a, b))
        assert len({(each.kind, each.where, each.name) for each in listed}) == len(listed)
        return {(each.kind, each.where): each for each in listed}

    return find


def over(text, metadata="") -> str:
    return f'over "Model" (\n{metadata}\n)\n{{\n{text}\n}}' if metadata else f'over "Model"\n{{\n{text}\n}}'


def test_a_stage_does_not_differ_from_itself(make) -> None:
    path = make(over("double size = 5"))
    assert list(differences(open_stage(path, variant="a"), open_stage(path, variant="a"))) == []


def test_a_variant_that_says_the_same_in_other_words_does_not_differ(make) -> None:
    """Equal values, the same file by another path, another comment."""
    path = make()
    assert list(differences(open_stage(path), open_stage(path, variant="same"))) == []


@pytest.mark.parametrize(
    ("text", "name", "before", "after"),
    [
        ("double size = 5.25", "size", "3.0", "5.25"),
        ("float share = 0.2", "share", "0.1", "0.2"),
        ("double size = None", "size", "3.0", None),
        ('token colour = "red"', "colour", None, '"red"'),
        ("int[] numbers = [1, 2, 3, 4, 5, 7]", "numbers", "[at 5: 6, 6 in all]", "[at 5: 7, 6 in all]"),
        ("color3f[] c = [(1, 0, 0.1)]", "c", None, "[(1.0, 0.0, 0.1)]"),
        ("quatd q = (1, 0, 0, 0.5)", "q", None, "(1.0, 0.0, 0.0, 0.5)"),
        ("matrix2d m = ((1, 0), (0, 2))", "m", None, "((1.0, 0.0), (0.0, 2.0))"),
    ],
)
def test_a_constant(found, text, name, before, after) -> None:
    (difference,) = found(over(text)).values()
    assert (difference.kind, difference.where) == ("attribute", f"/World/Model.{name}")
    assert (difference.before, difference.after, difference.samples) == (before, after, 0)


def test_where_the_stronger_opinions_come_from(found) -> None:
    """Its layer, and every variant on the way: of the stage, and of what it refers to."""
    difference = found(over("double size = 5"))["attribute", "/World/Model.size"]
    assert (difference.before_from, difference.after_from) == ("model.usda", "root.usda {augmentation=a}")


def test_what_a_selection_brings_names_both_variants(make) -> None:
    path = make()
    listed = list(differences(open_stage(path), open_stage(path, variant="a")))
    assert [(each.kind, each.where) for each in listed] == [("selection", "/World"), ("attribute", "/World/Model.coat")]
    selection, coat = listed
    assert (selection.name, selection.before, selection.after) == ("paint", None, "thick")
    assert selection.after_from == "root.usda {augmentation=a}"
    assert coat.after_from == "root.usda {paint=thick}"


def test_a_layer_referred_to_in_a_variant_is_listed_with_the_variant(found, tmp_path) -> None:
    (tmp_path / "values.usda").write_text('#usda 1.0\n(\ndefaultPrim = "V"\n)\nover "V"\n{\ndouble size = 9\n}\n')
    listed = found(over("", "prepend references = @./values.usda@"))
    assert set(listed) == {("file", "values.usda"), ("attribute", "/World/Model.size")}
    assert listed["attribute", "/World/Model.size"].after_from == "values.usda {augmentation=a}"
    assert listed["file", "values.usda"].before is None


def test_time_samples_are_counted_and_the_first_is_shown(found) -> None:
    (difference,) = found(over("double speed.timeSamples = {\n0: 1,\n1: 5,\n2: 3,\n3: 6,\n}")).values()
    assert (difference.before, difference.after) == ("2.0", "5.0")
    assert (difference.samples, difference.time_code) == (2, 1.0)


def test_a_constant_over_time_samples_differs_where_the_values_do(found) -> None:
    """Interpolated values count: at 2 the samples say 3 as well."""
    (difference,) = found(over("double speed = 3\ndouble speed.timeSamples = {\n2: 3,\n}")).values()
    assert (difference.samples, difference.time_code) == (2, 0.0)


@pytest.mark.parametrize(("file", "same"), [("copy", True), ("rust", False)])
def test_files_are_shown_with_their_content(found, file, same) -> None:
    listed = found(over(f"asset texture = @./textures/{file}.png@"))
    difference = listed["attribute", "/World/Model.texture"]
    before, after = (text.split() for text in (difference.before, difference.after))
    assert (before[0], after[0]) == ("@./textures/paint.png@", f"@./textures/{file}.png@")
    assert (before[1] == after[1]) is same
    assert ("file", f"textures/{file}.png") in listed


def test_relationships_and_connections(found) -> None:
    listed = found(over("rel friend = </World/Copies>\ndouble follows.connect = </World/Model.size>"))
    texts = {where: (each.before, each.after) for (_, where), each in listed.items()}
    assert texts == {
        "/World/Model.friend": ("</World/Model/Part>", "</World/Copies>"),
        "/World/Model.follows": ("</World/Model/Part.size>", "</World/Model.size>"),
    }


def test_schemas_and_metadata(found) -> None:
    metadata = 'prepend apiSchemas = ["SpinTargetAPI"]\nkind = "group"'
    listed = found(over('double size = 3 (\ndisplayName = "x"\n)\nint[] numbers (\ncolorSpace = "raw"\n)', metadata))
    texts = {each.name or kind: (each.before, each.after) for (kind, _), each in listed.items()}
    schemas = "MaterialBindingAPI"
    assert texts == {
        "schemas": (schemas, f"SpinTargetAPI, {schemas}"),
        "kind": ("component", "group"),
        "colorSpace": (None, "raw"),
    }


def test_a_prim_that_is_not_active_stands_for_all_below(found) -> None:
    listed = found(over('over "Part" (\nactive = false\n)\n{\ndouble size = 7\n}'))
    (difference,) = listed.values()
    assert (difference.kind, difference.before, difference.after) == ("active", "active", "not active")


def test_a_new_prim_stands_for_all_below(found) -> None:
    listed = found(over('def Xform "New"\n{\ndef Cube "X"\n{\n}\ndef Cube "Y"\n{\n}\n}'))
    (difference,) = listed.values()
    assert (difference.kind, difference.where) == ("prim", "/World/Model/New")
    assert (difference.before, difference.after) == (None, "Xform and 2 prims below")


def test_a_prim_that_is_nowhere_defined_is_none(found) -> None:
    assert found(over('over "Ghost"\n{\ndouble size = 7\n}')) == {}


def test_what_differs_inside_an_instance(found) -> None:
    (difference,) = found('over "Copies"\n{\nover "A"\n{\ndouble size = 8\n}\n}').values()
    assert (difference.where, difference.after) == ("/World/Copies/A.size", "8.0")


def test_a_stage_without_default_prim_is_compared(tmp_path) -> None:
    path = tmp_path / "bare.usda"
    path.write_text('#usda 1.0\ndef "A"\n{\ndouble x = 1\n}\n')
    assert list(differences(open_stage(path), open_stage(path))) == []
