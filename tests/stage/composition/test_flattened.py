"""The hash of stages with instances: USD numbers their prototypes as its threads come by, which must not show."""

import pytest
from pxr import Sdf

from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.composition.stage_hash import flattened_text, stage_hash

SHAPES = ("Cube", "Sphere", "Cone", "Cylinder", "Capsule", "Plane")
NESTED = """#usda 1.0
def Xform "Flattened_Prototype_{inner}"
{{
    def Cube "Box"
    {{
        double size = {size}
    }}
}}
def Xform "Flattened_Prototype_{outer}"
{{
    def "Within" (
        instanceable = true
        references = </Flattened_Prototype_{inner}>
    )
    {{
    }}
}}
def Xform "World"
{{
    def "A" (
        instanceable = true
        references = </Flattened_Prototype_{outer}>
    )
    {{
    }}
}}
"""


@pytest.fixture
def instanced(tmp_path):
    """A stage of two instances of each shape, the last one of `size`."""

    def write(name, size=1):
        folder = tmp_path / name
        folder.mkdir()
        prototypes = "".join(
            f'class Xform "P{i}"\n{{\n def {kind} "Shape"\n {{\n }}\n}}\n' for i, kind in enumerate(SHAPES)
        )
        uses = "".join(
            f'def "I{i}" (\n instanceable = true\n references = </P{i % len(SHAPES)}>\n)\n{{\n}}\n'
            for i in range(2 * len(SHAPES))
        )
        own = f'def Cube "Own"\n{{\n double size = {size}\n}}\n'
        (folder / "stage.usda").write_text(
            f'#usda 1.0\n(\n defaultPrim = "W"\n)\n{prototypes}def Xform "W"\n{{\n{own}{uses}}}\n'
        )
        return folder / "stage.usda"

    return write


def test_many_prototypes_hash_alike_each_time_and_anywhere(instanced) -> None:
    paths = [instanced(f"copy_{i}") for i in range(6)]
    assert len({stage_hash(open_stage(path)) for path in paths}) == 1


def test_the_hash_follows_what_instances_are_of(instanced) -> None:
    first = instanced("a")
    swapped = instanced("b")
    swapped.write_text(swapped.read_text().replace("def Cone", "def Plane"))
    hashes = {stage_hash(open_stage(path)) for path in (first, swapped, instanced("c", size=2))}
    assert len(hashes) == 3


def text(**options):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(NESTED.format(**options))
    return flattened_text(layer)


def test_prototypes_of_prototypes_are_named_by_who_refers_to_them() -> None:
    assert text(inner=1, outer=2, size=3) == text(inner=2, outer=1, size=3) == text(inner=17, outer=4, size=3)
    assert text(inner=1, outer=2, size=3) != text(inner=1, outer=2, size=4)


def test_one_prototype_is_written_as_usd_writes_it() -> None:
    """So the hashes of such stages stay what they were."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString('#usda 1.0\ndef Xform "Flattened_Prototype_1"\n{\n}\n')
    assert flattened_text(layer) == layer.ExportToString()
