"""`spin-usd diff` on a real stage: what each property costs, and how it is shown."""

import json
import re
import shutil

import pytest
from msgspec import to_builtins

from spin_usd.commands.diff.calls import CompareVariants
from spin_usd.commands.diff.in_child import Selection, compare
from spin_usd.errors import InputError, SpinError
from spin_usd.planning.render_plan import plan
from spin_usd.scene.derived.content_keys import KEYS
from spin_usd.scene.effort import Effort
from tests.cases.requests import request_for
from tests.cases.root_layers import over_stage

SETS = """
    variantSet "augmentation" = {
        VARIANTS
    }
    variantSet "tint" = {
        "warm" {
            over "Lights"
            {
                over "Sun"
                {
                    color3f inputs:color = (1, 0.8, 0.6)
                }
            }
        }
    }
"""
OPTICS = 'prepend apiSchemas = ["SpinOpticsAPI"]'


def over(*path, text="", metadata="") -> str:
    first, *rest = path
    inner = over(*rest, text=text, metadata=metadata) if rest else text
    return f'over "{first}" (\n{"" if rest else metadata}\n)\n{{\n{inner}\n}}\n'


SUN, SURFACE = ("Lights", "Sun"), ("Target", "Model", "mtl", "BlackPaint", "Surface")
VARIANTS = {
    "same": "",
    "lens": over("Camera", text="double spin:lens:fx = 400"),
    "glare": over("Camera", text="double spin:optics:glare = 0.05", metadata=OPTICS),
    "late": over("Camera", text="float exposure:time.timeSamples = {\n0: 0.01,\n5: 0.01,\n6: 0.02,\n}"),
    "dim": over(*SUN, text="float inputs:intensity = 900"),
    "turned": over(*SUN, text="float3 xformOp:rotateXYZ = (50, 0, 30)"),
    "dark": over(*SUN, metadata="active = false"),
    "lamp": over("Lights", text='def SphereLight "Lamp"\n{\ndouble3 xformOp:translate = (0, 0, 3)\n'
                                'uniform token[] xformOpOrder = ["xformOp:translate"]\n}'),
    "rough": over(*SURFACE, text="float inputs:roughness = 0.9"),
    "idle": over("Camera", text="float2 clippingRange = (0.5, 900)"),
}  # fmt: skip
# variant -> the property that it changes, which key that changes, and in how many of the eight pictures
EFFECTS = {
    "lens": ("/World/Camera.spin:lens:fx", "geometry", 8),
    "glare": ("/World/Camera.spin:optics:glare", "exposure", 8),
    "late": ("/World/Camera.exposure:time", "exposure", 2),
    "dim": ("/World/Lights/Sun.inputs:intensity", "exposure", 8),
    "turned": ("/World/Lights/Sun.xformOp:rotateXYZ", "radiance", 8),
    "dark": ("/World/Lights/Sun", "radiance", 8),
    "lamp": ("/World/Lights/Lamp", "radiance", 8),
    "rough": ("/World/Target/Model/mtl/BlackPaint/Surface.inputs:roughness", "radiance", 8),
    "idle": ("/World/Camera.clippingRange", "nothing", 0),
}


def quiet(*_) -> None:
    pass


def diff(stage, before, after, *, frames=None):
    request = CompareVariants(stage=str(stage), before=before, after=after, frames=frames)
    return to_builtins(compare(request, quiet))


@pytest.fixture(scope="module")
def stage(small_stage, tmp_path_factory):
    folder = tmp_path_factory.mktemp("diff") / "stage"
    shutil.copytree(small_stage.parent, folder)
    all_of = "".join(f'"{name}" {{\n{text}\n}}\n' for name, text in VARIANTS.items())
    sets = 'prepend variantSets = ["augmentation", "tint"]'
    (folder / "variants.usda").write_text(over_stage(frames=8, metadata=sets, body=SETS.replace("VARIANTS", all_of)))
    return folder / "variants.usda"


@pytest.mark.slow
@pytest.mark.parametrize("variant", EFFECTS)
def test_a_property_costs_what_it_changes(stage, variant) -> None:
    where, effect, pictures = EFFECTS[variant]
    answer = diff(stage, "nominal", variant)
    assert [each["where"] for each in answer["differences"] if each["kind"] != "schemas"] == [where]
    weakest = KEYS.index(effect) if effect in KEYS else len(KEYS)
    expected = {key: pictures if i >= weakest else 0 for i, key in enumerate(KEYS)}
    assert answer["pictures"] == {"compared": 8, "only_before": 0, "only_after": 0, **expected}


@pytest.mark.slow
@pytest.mark.parametrize("variant", ["lens", "late", "turned"])
def test_the_way_back_costs_the_same(stage, variant) -> None:
    there, back = (diff(stage, *pair) for pair in (("nominal", variant), (variant, "nominal")))
    assert there["pictures"] == back["pictures"]
    assert [(d["before"], d["after"]) for d in there["differences"]] == [
        (d["after"], d["before"]) for d in back["differences"]
    ]


def test_the_keys_that_differ_are_those_of_the_plan(stage) -> None:
    """The plan's exposure keys hold the picture's own seed; the others are the same in both."""
    request = request_for(stage, variants=("nominal", "turned"), effort=Effort())
    pictures = plan(request, progress=quiet).pictures
    of = {name: [p for p in pictures if p.variant == name] for name in request.variants}
    answer = diff(stage, "nominal", "turned")
    for key in ("geometry", "radiance"):
        pairs = zip(*([getattr(p, key) for p in some] for some in of.values()), strict=True)
        assert sum(a != b for a, b in pairs) == answer["pictures"][key]


def test_variants_that_are_the_same_differ_in_their_noise_alone(stage, spin_usd) -> None:
    told = spin_usd("diff", stage, "nominal", "same").stdout
    assert "the images differ only in random samples" in told


def test_a_variant_does_not_differ_from_itself(stage, spin_usd) -> None:
    told = spin_usd("diff", stage, "same", "same", "--frames", ":1").stdout.splitlines()
    assert told == [
        "same is composed as same is",
        "of 1 picture: labels differ in 0, renders in 0, images in 0",
        "nothing differs in any picture",
    ]


def test_other_sets_can_be_compared(stage, spin_usd) -> None:
    answer = json.loads(spin_usd("diff", stage, "dim", "dim,tint=warm", "--frames", "2:5", "--json").stdout)
    assert [each["where"] for each in answer["differences"]][-1] == "/World/Lights/Sun.inputs:color"
    assert answer["pictures"]["compared"] == answer["pictures"]["exposure"] == 3


def test_what_is_told_names_property_values_origin_and_cost(stage, spin_usd) -> None:
    told = spin_usd("diff", stage, "nominal", "late").stdout
    assert "exposure:time   0.01 -> 0.02   (at 6, the only time sample that differs)" in told
    assert "layers/camera.usda -> variants.usda {augmentation=late}" in told
    assert "of 8 pictures: labels differ in 0, renders in 0, images in 2" in told


@pytest.mark.parametrize(
    ("arguments", "saying"),
    [
        (("nominal", "sma"), "has no variant 'sma'; choose one of nominal, dark,"),
        (("colour=red", "dim"), "has no variant set 'colour' on its default prim; choose one of "),
        (("tint=cold", "dim"), "has no variant 'cold' in its set 'tint'; choose one of warm"),
        (("dim", "dim,late"), "'dim,late' cannot be understood as a variant"),
    ],
)
def test_bad_input_is_refused(stage, arguments, saying) -> None:
    with pytest.raises(SpinError, match=re.escape(saying)):
        diff(stage, *arguments)


def test_bad_input_is_one_sentence(stage, spin_usd) -> None:
    done = spin_usd("diff", stage, "dim", "late", "--frames", "9:", code=2)
    assert "frames '9:' selects none of the 8 frames" in done.stderr.splitlines()[-1]
    assert done.stdout == ""


@pytest.mark.parametrize("text", ["", "=", "a=", "=b", "a,b", "a=b,a=c", "a,augmentation=b"])
def test_what_names_no_variant_is_refused(text) -> None:
    with pytest.raises(InputError, match="cannot be understood as a variant"):
        Selection.parse(text)


@pytest.mark.parametrize(
    ("text", "variant", "others"),
    [
        ("nominal", "nominal", {}),
        ("isda_1", "isda_1", {}),
        ("camera=rich, materials=plain", "nominal", {"camera": "rich", "materials": "plain"}),
        ("isda_1,camera=rich", "isda_1", {"camera": "rich"}),
        ("augmentation=isda_1", "isda_1", {}),
    ],
)
def test_a_variant_as_it_is_written(text, variant, others) -> None:
    assert Selection.parse(text) == Selection(variant=variant, others=others)
