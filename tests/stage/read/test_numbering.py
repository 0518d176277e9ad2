"""Ids hold: neither what a stronger layer names first, nor what a variant or a time hides, changes any other number."""

from pathlib import Path

import numpy as np
import pytest

from spin_usd.errors import StageError
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings
from spin_usd.scene.derived.part_classes import class_of_parts
from spin_usd.scene.effort import Effort
from spin_usd.stage.read.numbering import Numbering
from spin_usd.stage.read.stage_reader import StageReader

KEYS = KeyMaker(RenderSettings(renderer="blender", effort=Effort(), seed=3))

STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    metersPerUnit = 1
    startTimeCode = 0
    endTimeCode = 1
)

def Xform "World" (
    variants = {{ string augmentation = "{selected}" }}
    prepend variantSets = "augmentation"
)
{{
    def Camera "Camera" ( prepend apiSchemas = ["SpinLensAPI"] )
    {{
        int2 spin:lens:imageSize = (80, 60)
        double spin:lens:fx = 100
        double spin:lens:fy = 100
        double spin:lens:cx = 40
        double spin:lens:cy = 30
    }}

    def DistantLight "Sun"
    {{
        color3f inputs:color = (1, 0.5, 0.25)
    }}
    def DistantLight "Lamp"
    {{
        float3 xformOp:rotateXYZ = (0, 40, 0)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
    }}

    def Xform "Second" ( prepend apiSchemas = ["SpinTargetAPI"] )
    {{
        double3 xformOp:translate = (0, 0, -10)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Cube "C" {{}}
        def Cube "B"
        {{
            {blinks}
        }}
        def Cube "A"
        {{
            double size = 2.5
        }}
    }}

    def Xform "First" ( prepend apiSchemas = ["SpinTargetAPI"] )
    {{
        double3 xformOp:translate = (2, 0, -12)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Mesh "Two"
        {{
            int[] faceVertexCounts = [3, 3]
            int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
            def GeomSubset "Low" ( prepend apiSchemas = ["SemanticsLabelsAPI:part"] )
            {{
                uniform token[] semantics:labels:part = ["Low"]
                int[] indices = [0]
            }}
            def GeomSubset "High" ( prepend apiSchemas = ["SemanticsLabelsAPI:part"] )
            {{
                uniform token[] semantics:labels:part = ["High"]
                int[] indices = [1]
            }}
        }}
    }}

    def Cube "Arm"
    {{
        double3 xformOp:translate.timeSamples = {{ 0: (-3, 0, -8), 1: (-3, 1, -8) }}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def Cube "Boom"
    {{
        double3 xformOp:translate.timeSamples = {{ 0: (3, 0, -8), 1: (3, 1, -8) }}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}

    variantSet "augmentation" = {{
        "same" {{
        }}
{variants}
    }}
}}
"""
SHUFFLED = """
        "shuffled" {
            reorder nameChildren = ["Lamp", "Boom", "First", "Second", "Arm", "Sun", "Camera"]
            over "Lamp" {}
            over "Boom" {}
            over "First" {
                over "Two" {
                    over "High" {}
                    over "Low" {}
                }
            }
            over "Second" {
                over "A" {}
                over "B" {}
            }
        }"""
VARIANTS = {
    "hidden": 'over "Second" {\nover "A" {\ntoken visibility = "invisible"\n}\n}',
    "off": 'over "Second" {\nover "B" (\nactive = false\n) {}\n}\nover "Arm" (\nactive = false\n) {}',
    "more": 'over "Second" {\ndef Sphere "Aa" {}\n}\ndef Cube "AAA" {}',
    "nearer": 'over "First" {\ndouble3 xformOp:translate = (2, 0, -9)\n}',
}


def write(folder: Path, *, variants: str = "", selected: str = "", blinks: str = "", name: str = "stage.usda") -> Path:
    path = folder / name
    path.write_text(STAGE.format(variants=variants, selected=selected, blinks=blinks))
    return path


def in_variants(*names: str) -> str:
    return "\n".join(f'"{name}" {{\n{VARIANTS[name]}\n}}' for name in names)


def scene_of(path: Path, variant: str = "nominal", frame: int = 0):
    reader = StageReader(path, variant=variant)
    return reader.scene(reader.frames[frame])


def ids(scene) -> dict[str, int]:
    """The number in labels of each part that has faces here, by its path."""
    found: dict[str, int] = {}
    for body, before in zip(scene.bodies, scene.part_offsets, strict=True):
        seen = set(np.unique(body.target.mesh.face_part))
        found |= {part.path: before + part.id for part in body.target.parts if part.id in seen}
    return found


def test_no_order_of_opinions_changes_a_number_or_a_key(tmp_path) -> None:
    """A variant that only overrides, and a stronger layer that reorders: the same ids, faces, lights, and keys."""
    plain = write(tmp_path, name="plain.usda")
    shuffled = write(tmp_path, variants=SHUFFLED, name="shuffled.usda")
    above = tmp_path / "above.usda"
    above.write_text("""#usda 1.0
(
    subLayers = [@./plain.usda@]
    defaultPrim = "World"
    upAxis = "Z"
    metersPerUnit = 1
    startTimeCode = 0
    endTimeCode = 1
)
over "World"
{
    reorder nameChildren = ["First", "Second", "Boom", "Arm", "Lamp", "Sun"]
    over "First" {
        over "Two" {
            reorder nameChildren = ["High", "Low"]
        }
    }
    over "Second" {
        reorder nameChildren = ["A", "B", "C"]
    }
}
""")
    expected = scene_of(plain)
    assert [body.target.path for body in expected.targets] == ["/World/Second", "/World/First"]
    for scene in (scene_of(shuffled, "shuffled"), scene_of(above)):
        assert ids(scene) == ids(expected)
        for body, other in zip(scene.bodies, expected.bodies, strict=True):
            assert body.target.mesh.faces.tobytes() == other.target.mesh.faces.tobytes()
            assert body.target.mesh.face_part.tobytes() == other.target.mesh.face_part.tobytes()
        assert KEYS.keys(scene).geometry == KEYS.keys(expected).geometry
        assert KEYS.keys(scene).radiance == KEYS.keys(expected).radiance


@pytest.mark.parametrize("variant", VARIANTS)
def test_what_a_variant_hides_or_adds_renumbers_nothing(tmp_path, variant) -> None:
    path = write(tmp_path, variants=in_variants(*VARIANTS))
    nominal, other = ids(scene_of(path)), ids(scene_of(path, variant))
    shared = nominal.keys() & other.keys()
    assert len(shared) >= 4
    assert {part: nominal[part] for part in shared} == {part: other[part] for part in shared}
    assert len({**nominal, **other}) == len({*nominal.values(), *other.values()}), "no number means two parts"


def test_a_part_that_blinks_renumbers_nothing(tmp_path) -> None:
    path = write(tmp_path, blinks='token visibility.timeSamples = { 0: "inherited", 1: "invisible" }')
    first, second = ids(scene_of(path, frame=0)), ids(scene_of(path, frame=1))
    assert first.keys() - second.keys() == {"/World/Second/B"}
    assert second == {part: number for part, number in first.items() if part in second}


def test_what_is_hidden_changes_no_class(tmp_path) -> None:
    """The class of each part is the same number where an occluder before it, of another class, is hidden."""
    path = write(tmp_path, variants='"off" {\nover "Arm" (\nactive = false\n) {}\n}')
    path.write_text(
        path.read_text().replace(
            'def Cube "Arm"\n    {',
            'def Cube "Arm" (\nprepend apiSchemas = ["SemanticsLabelsAPI:class"]\n)\n'
            '{\nuniform token[] semantics:labels:class = ["arm"]',
        )
    )
    whole, without = scene_of(path), scene_of(path, "off")
    assert len(without.bodies) == len(whole.bodies) - 1
    assert class_of_parts(without).tolist() == class_of_parts(whole).tolist()
    assert len(class_of_parts(without)) == 1 + max(ids(whole).values())


def test_numbers_are_those_of_any_reader(tmp_path) -> None:
    """They depend on the stage, not on the variant that is read first."""
    path = write(tmp_path, variants=in_variants(*VARIANTS))
    found = [list(StageReader(path, variant=variant).numbering.bodies) for variant in ("nominal", *VARIANTS)]
    assert all(each == found[0] for each in found)


def test_a_variant_that_cannot_be_read_stops_no_other(tmp_path) -> None:
    other = (
        'over "First" {\ndef NurbsCurves "No" {}\ndef Xform "Also" (\nprepend apiSchemas = ["SpinTargetAPI"]\n) {}\n}'
    )
    broken = f'"broken" {{\n{other}\n}}'
    path = write(tmp_path, variants=broken)
    assert ids(scene_of(path)) == ids(scene_of(write(tmp_path, name="plain.usda")))


@pytest.mark.parametrize(
    ("change", "saying"),
    [
        ('over "Second" (\nactive = false\n) {}', "/World/Second: is not a target of this variant"),
        (
            'def Cube "Third" ( prepend apiSchemas = ["SpinTargetAPI"] ) {}',
            "/World/Third: is a target of this variant alone",
        ),
        (
            'over "Second" {\nuniform token spin:target:name = "other"\n}',
            "/World/Second: has the name 'other' in this variant, and 'Second' in another",
        ),
        (
            'over "Second" {\nover "A" (\nprepend apiSchemas = ["SemanticsLabelsAPI:class"]\n) '
            '{\nuniform token[] semantics:labels:class = ["panel"]\n}\n}',
            "/World/Second/A: has the class 'panel' in this variant, and 'unknown' in another",
        ),
    ],
)
def test_a_variant_in_which_an_id_means_something_else_is_refused(tmp_path, change, saying) -> None:
    path = write(tmp_path, variants=f'"other" {{\n{change}\n}}')
    assert len(scene_of(path).targets) == 2
    with pytest.raises(StageError, match=saying):
        StageReader(path, variant="other")


def test_subsets_of_points_are_no_parts(tmp_path) -> None:
    """They hold no face, so that those of the mesh stay its own."""
    path = write(tmp_path)
    path.write_text(
        path.read_text().replace("int[] indices = [0]", 'int[] indices = [0, 1]\nuniform token elementType = "point"')
    )
    assert set(ids(scene_of(path))) >= {"/World/First/Two", "/World/First/Two/High"}


def test_numbering_is_shared_by_readers_after(tmp_path) -> None:
    path = write(tmp_path, variants=in_variants("nearer"))
    first = StageReader(path)
    assert StageReader(path, variant="nearer", after=first).numbering is first.numbering
    assert isinstance(first.numbering, Numbering)


@pytest.mark.parametrize("moves", [True, False])
def test_an_occluder_s_own_class_is_its_own(tmp_path, moves) -> None:
    """Also where it is a frame of its own, as what moves is."""
    path = write(tmp_path)
    still = path.read_text().replace(
        "translate.timeSamples = { 0: (-3, 0, -8), 1: (-3, 1, -8) }", "translate = (-3, 0, -8)"
    )
    labelled = (path.read_text() if moves else still).replace(
        'def Cube "Arm"\n    {',
        'def Cube "Arm" (\nprepend apiSchemas = ["SemanticsLabelsAPI:class"]\n)\n'
        '{\nuniform token[] semantics:labels:class = ["arm"]',
    )
    path.write_text(labelled)
    scene = scene_of(path)
    classes = {part.name: part.class_name for body in scene.bodies for part in body.target.parts}
    assert classes["Arm"] == "arm"
    assert classes["Boom"] == "unknown"
