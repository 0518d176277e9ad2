"""Rules on variants: each finding has a stage that shows it, and what is right has none."""

import shutil
from pathlib import Path

import pytest

from spin_usd.stage.check.check_stage import check_stage
from tests.cases.root_layers import over_stage

FRAMES = 3
VALUES = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
)

over "World"
{{
    {body}
}}
"""
DIM = 'over "Lights"\n{\nover "Sun"\n{\nfloat inputs:intensity = 700\n}\n}'


@pytest.fixture(scope="module")
def authored(cubesat_stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(cubesat_stage.parent, tmp_path_factory.mktemp("variants") / "stage")) / "dataset.usda"


class Edited:
    """A layer over the authored stage, with variant sets of its own on /World."""

    def __init__(self, authored: Path, name: str) -> None:
        self.authored, self.name = authored, name

    def write(self, augmentations: dict[str, str], *, local: str = "", metadata: str = "", other: str = "") -> Path:
        """augmentations: by name, a variant's own "(metadata) {body}" · other: whole variant sets beside them."""
        given = "\n".join(f'"{name}" {text}' for name, text in augmentations.items())
        variants = f'variantSet "augmentation" = {{\n{given}\n}}\n{other}'
        sets = '["augmentation", "dust"]' if other else '"augmentation"'
        metadata = f"{metadata}\nprepend variantSets = {sets}"
        text = over_stage(frames=FRAMES, metadata=metadata, body=f"{local}\n{variants}")
        path = self.authored.parent / f"{self.name}.usda"
        path.write_text(text)
        return path

    def values(self, body: str) -> str:
        """Writes a layer for a variant to refer to; returns the "(metadata) {body}" of that variant."""
        file = self.authored.parent / f"{self.name}_values.usda"
        file.write_text(VALUES.format(body=body))
        return f"(\nprepend references = @./{file.name}@</World>\n) {{\n}}"


@pytest.fixture
def edited(authored: Path, request: pytest.FixtureRequest) -> Edited:
    name = "".join(c if c.isalnum() else "_" for c in request.node.name)
    return Edited(authored, name)


def found(path: Path) -> list[tuple[str, str, str]]:
    return [(finding.code, finding.where, finding.message) for finding in check_stage(path)]


def one(path: Path, code: str, where: str, *words: str) -> None:
    """There is that finding and no other."""
    ((found_code, found_where, message),) = found(path)
    assert (found_code, found_where) == (code, where)
    assert all(word in message for word in words), message


def selecting(**selections: str) -> str:
    lines = "\n".join(f'string {name} = "{variant}"' for name, variant in selections.items())
    return f"(\nvariants = {{\n{lines}\n}}\n)"


def test_augmentations_that_select_and_override_are_fine(edited: Edited) -> None:
    """An augmentation overrides the sets that it selects among: no fight; what it refers to is alive."""
    glare = 'over "Camera"\n{\ndouble spin:optics:glare = 0.1\n}'
    lit = 'over "Lights"\n{\nover "RichSun"\n{\nfloat inputs:intensity = 700\n}\n}'
    assert found(edited.write({
        "hazy": f"{selecting(camera='rich', materials='plain')} {{\n{glare}\n}}",
        "lit": f"{selecting(environment='rich')} {{\n{lit}\n}}",
        "dim": edited.values(DIM),
    })) == []  # fmt: skip


@pytest.mark.parametrize("referred", [False, True], ids=["in the variant", "referred to"])
def test_a_value_beaten_by_a_local_one_is_dead(edited: Edited, referred: bool) -> None:
    body = 'over "Target"\n{\ndouble3 xformOp:translate = (0, 9, 0)\n}'
    there = 'over "Camera"\n{\ndouble spin:sensor:contrast = 2\n}'  # so that its pictures are not nominal's
    text = edited.values(f"{body}\n{there}") if referred else f"{{\n{body}\n{there}\n}}"
    where = "/World/Target.xformOp:translate"
    one(edited.write({"near": text}), "variant-dead", where, "augmentation=near", "poses.usdc")


DEAD = {
    "selection": (
        selecting(camera="rich") + " {\n" + DIM + "\n}",
        {"metadata": 'variants = {\nstring camera = "plain"\n}'},
        ("/World", "selection of camera", "local"),
    ),
    "active": (
        f'{{\n{DIM}\nover "Environment" (\nactive = false\n)\n{{\n}}\n}}',
        {"local": 'over "Environment" (\nactive = true\n)\n{\n}'},
        ("/World/Environment", "active", "local"),
    ),
    "relationship": (
        f'{{\n{DIM}\nover "Target"\n{{\nrel proxyPrim = </World/Target/Model>\n}}\n}}',
        {"local": 'over "Target"\n{\nrel proxyPrim = </World/Camera>\n}'},
        ("/World/Target.proxyPrim", "this value", "local"),
    ),
    "switched off": (
        f"{selecting(environment='rich')} {{\n{DIM}\n}}",
        {},
        ("/World/Lights/Sun.inputs:intensity", "inactive"),
    ),
    "not defined": (
        f'{{\n{DIM}\nover "Camra"\n{{\nfloat exposure = 1\n}}\n}}',
        {},
        ("/World/Camra.exposure", "nothing defines"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", DEAD)
def test_what_does_nothing_is_dead(edited: Edited, what: str) -> None:
    text, options, (where, *words) = DEAD[what]
    one(edited.write({"dead": text}, **options), "variant-dead", where, "augmentation=dead", *words)


@pytest.mark.parametrize(
    ("selection", "words"),
    [({"camera": "rihc"}, ("camera=rihc", "plain, rich")), ({"camra": "rich"}, ("camra=rich", "camera, environment"))],
)
def test_a_selection_of_what_is_not_there_is_told(
    edited: Edited, selection: dict[str, str], words: tuple[str, ...]
) -> None:
    text = f"{selecting(**selection)} {{\n{DIM}\n}}"
    one(edited.write({"wrong": text}), "variant-unknown", "/World", "augmentation=wrong", *words)


def test_a_selection_of_what_is_not_there_is_told_of_the_stage_itself(edited: Edited) -> None:
    path = edited.write({"dim": f"{{\n{DIM}\n}}"}, metadata='variants = {\nstring materials = "shiny"\n}')
    one(path, "variant-unknown", "/World", "materials=shiny", "plain, rich")


def test_two_sets_that_say_the_same_fight_though_none_is_selected(edited: Edited) -> None:
    """The camera set's own value comes by reference within its variant."""
    dust = 'variantSet "dust" = {\n"some" {\nover "Camera"\n{\ndouble spin:optics:glare = 0.3\n}\n}\n}'
    path = edited.write({"dim": f"{{\n{DIM}\n}}"}, other=dust)
    one(path, "variant-overlap", "/World/Camera.spin:optics:glare", "dust=some", "camera=", "dust wins")


def test_a_variant_that_does_not_compose_is_told_though_nothing_selects_it(edited: Edited) -> None:
    dust = 'variantSet "dust" = {\n"some" {\nover "Camera" (\nreferences = </World/Gone>\n)\n{\n}\n}\n}'
    path = edited.write({"dim": f"{{\n{DIM}\n}}"}, other=dust)
    one(path, "variant-broken", "/World", "dust=some", "Gone")


def test_an_augmentation_that_changes_no_picture_is_told(edited: Edited) -> None:
    """Of each kind the first; one that differs in the last picture alone is another."""
    last = 'over "Camera"\n{\nfloat exposure.timeSamples = { 1: 0, 2: 1 }\n}'
    path = edited.write(
        {"a_nothing": "{\n}", "b_dim": f"{{\n{DIM}\n}}", "c_dim": f"{{\n{DIM}\n}}", "d": f"{{\n{last}\n}}"}
    )
    told = found(path)
    assert [code for code, _, _ in told] == ["variant-same", "variant-same"]
    assert "a_nothing are those of nominal" in told[0][2]
    assert "c_dim are those of b_dim" in told[1][2]
