"""The one way to layers and stages: within limits, whatever they ask for, and no other way."""

import ast
import itertools
import os
import zipfile
from pathlib import Path

import pytest

import spin_usd
from spin_usd.errors import StageError
from spin_usd.stage.author.from_usd import copy_usd_target
from spin_usd.stage.composition.files import files_of
from spin_usd.stage.composition.open_stage import open_as_it_is, open_stage

STAGE = Path(spin_usd.__file__).parent / "stage"
OPENERS = {"Open", "OpenMasked", "OpenAsAnonymous", "FindOrOpen", "FindOrOpenRelativeToLayer", "LocalizeAsset"}
# What the guard has looked at may be localized; Sdf.ZipFile.Open opens no layer.
OPENS = {"composition", "usd/layer_file.py", "author/from_usd.py"}
CUBE = 'def Cube "Box" {\n}\n'


def layer(path, body, head='defaultPrim = "A"\nmetersPerUnit = 1'):
    path.write_text(f"#usda 1.0\n(\n{head}\n)\n{body}")
    return path


def test_layers_are_opened_in_one_place() -> None:
    for file in STAGE.rglob("*.py"):
        name = file.relative_to(STAGE).as_posix()
        calls = (node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Attribute))
        found = [f"{name}:{node.lineno}" for node in calls if node.attr in OPENERS]
        assert not found or name in OPENS or name.split("/")[0] in OPENS


@pytest.mark.parametrize(
    "named",
    ["{outside}/secret.usda", "../outside/secret.usda", "..\\outside\\secret.usda", "link.usda", "pipe.usda"],
)
@pytest.mark.parametrize("arc", ["reference", "texture"])
def test_a_target_takes_in_files_of_its_own_folder_only(tmp_path, named, arc) -> None:
    """Nothing from outside is copied into the stage, and nothing is waited for."""
    for folder in ("outside", "own"):
        (tmp_path / folder).mkdir()
    layer(tmp_path / "outside" / "secret.usda", f'def Xform "A" {{\n{CUBE}}}\n')
    (tmp_path / "own" / "link.usda").symlink_to(tmp_path / "outside" / "secret.usda")
    os.mkfifo(tmp_path / "own" / "pipe.usda")
    path = named.format(outside=tmp_path / "outside")
    body = {
        "reference": f'def Xform "A" (\nreferences = @{path}@\n) {{\n{CUBE}}}\n',
        "texture": f'def Xform "A" {{\n{CUBE}asset inputs:file = @{path}@\n}}\n',
    }
    target = layer(tmp_path / "own" / "target.usda", body[arc])
    with pytest.raises(StageError, match=r"refers to|regular file"):
        copy_usd_target(target, tmp_path / "out" / "target", "target", None)
    assert not (tmp_path / "out").exists()


def doubled(path, levels):
    """Write a stage of 2^levels prims in so many lines."""
    arcs = "".join(
        f'def Xform "P{i}" {{\ndef "a" (\nreferences = </P{i + 1}>\n) {{\n}}\n'
        f'def "b" (\npayload = </P{i + 1}>\n) {{\n}}\n}}\n'
        for i in range(levels)
    )
    return layer(path, f'{arcs}def Xform "P{levels}" {{\n}}\n', head='defaultPrim = "P0"')


def test_a_stage_is_counted_before_it_is_composed(tmp_path, monkeypatch) -> None:
    """2^30 prims would take hours and all memory."""
    monkeypatch.setattr("spin_usd.stage.composition.excess.MAX_PRIMS", 5_000)
    for opened in (open_stage, open_as_it_is):
        with pytest.raises(StageError, match="has more than 5000 prims"):
            opened(doubled(tmp_path / "bomb.usda", 30))


def test_what_a_variant_holds_is_counted_when_it_is_chosen(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("spin_usd.stage.composition.excess.MAX_PRIMS", 5_000)
    doubled(tmp_path / "bomb.usda", 30)
    body = 'def "A" (\nprepend variantSets = "augmentation"\n) {\nvariantSet "augmentation" = {\n"big" (\n'
    root = layer(tmp_path / "root.usda", f"{body}references = @./bomb.usda@\n) {{\n}}\n}}\n}}\n")
    open_stage(root)
    with pytest.raises(StageError, match="has more than 5000 prims"):
        open_stage(root, variant="big")


@pytest.mark.slow
def test_prims_do_not_nest_deeper_than_they_can_be_walked(tmp_path) -> None:
    """References nest what no layer does by itself."""
    names = [f"P{i}" for i in range(300)]
    arcs = (f'def "{a}" {{\ndef "x" (\nreferences = </{b}>\n) {{\n}}\n}}\n' for a, b in itertools.pairwise(names))
    with pytest.raises(StageError, match="nests prims deeper than 256"):
        open_as_it_is(layer(tmp_path / "deep.usda", f'{"".join(arcs)}def "P299" {{\n}}\n'))


def test_packages_are_looked_into_before_they_are_opened(tmp_path) -> None:
    depth = 60_000
    text = "#usda 1.0\n" + 'def "a" {\n' * depth + "}\n" * depth
    for name, inner, saying in (("deep", "a.usda", "nests brackets"), ("nested", "a.usdz", "package within a package")):
        with zipfile.ZipFile(tmp_path / f"{name}.usdz", "w") as package:
            package.writestr(inner, text)
        with pytest.raises(StageError, match=saying):
            open_as_it_is(tmp_path / f"{name}.usdz")


def test_folders_have_any_names(tmp_path) -> None:
    """Brackets mean a package in an asset path only where they end it."""
    folder = tmp_path / "run[1] ä'b"
    folder.mkdir()
    layer(folder / "sub[2].usda", f'def Xform "A" {{\n{CUBE}}}\n')
    root = layer(folder / "root.usda", 'def Xform "A" (\nreferences = @./sub[2].usda@\n) {\n}\n')
    assert open_stage(root).GetPrimAtPath("/A/Box")
    with pytest.raises(StageError, match="not UTF-8"):
        files_of(os.fsdecode(bytes(tmp_path) + b"/x\xff.usda"))


def test_a_layer_is_looked_into_again_when_it_has_changed(tmp_path) -> None:
    """What was found in a file is kept for that version of it."""
    root = layer(tmp_path / "root.usda", f'def Xform "A" {{\n{CUBE}}}\n')
    assert files_of(root).missing == ()
    layer(root, 'def Xform "A" (\nreferences = @../outside.usda@\n) {\n}\n')
    with pytest.raises(StageError, match="outside the stage's folder"):
        files_of(root)


def test_a_package_whose_first_layer_cannot_be_read_is_told(tmp_path) -> None:
    """USD gives no layer then, and no error."""
    with zipfile.ZipFile(tmp_path / "a.usdz", "w") as package:
        package.writestr("a.txt", "no layer")
    for opened in (open_as_it_is, open_stage):
        with pytest.raises(StageError, match=r"a\.usdz"):
            opened(tmp_path / "a.usdz")


def test_a_layer_of_text_is_bounded(tmp_path) -> None:
    """A sparse file costs nothing to send."""
    for head in (b"#usda 1.0\n", b""):
        path = tmp_path / "sparse.usda"
        path.write_bytes(head)
        os.truncate(path, 2**30)
        with pytest.raises(StageError, match=r"bytes of text, more than|is not a USD layer"):
            files_of(path)


@pytest.mark.parametrize(("first", "method", "saying"), [
    ("tex.png", zipfile.ZIP_STORED, r"begins with 'tex\.png', and a package begins with its layer"),
    ("a.usda", zipfile.ZIP_DEFLATED, r"a\.usdz\[a\.usda\]: is compressed"),
])  # fmt: skip
def test_rules_of_packages_are_named(tmp_path, first, method, saying) -> None:
    with zipfile.ZipFile(tmp_path / "a.usdz", "w", method) as package:
        package.writestr(first, '#usda 1.0\ndef "A" {\n}\n')
    with pytest.raises(StageError, match=saying):
        open_as_it_is(tmp_path / "a.usdz")


CLOSING = ("]" * 100 + "/") * 4


@pytest.mark.parametrize(
    "hidden",
    [
        f'string s = "{CLOSING}"',
        f"string s = '{CLOSING}'",
        f'string s = "a\\"{CLOSING}"',
        f'string s = """\n""{CLOSING}\\""" """',
        f"string s = '''\n{CLOSING}'''",
        f"asset s = @{CLOSING}@",
        f"asset s = @@@{CLOSING}\\@@@]@@@",
        f"# it's {CLOSING}",
        f'// a " {CLOSING}',
        f"/* '\n{CLOSING} */",
    ],
)
@pytest.mark.parametrize("deep", [True, False])
def test_brackets_in_strings_comments_and_asset_paths_nest_nothing(tmp_path, hidden, deep) -> None:
    """Neither closing ones before 300 lists, which they would hide, nor as many opening ones."""
    text = hidden if deep else hidden.replace("]", "[")
    value = "[" * 300 + "]" * 300 if deep else "[]"
    root = layer(tmp_path / "a.usda", f'def "A" (\ncustomData = {{\n{text}\ndouble[] x = {value}\n}}\n) {{\n}}\n')
    if deep:
        with pytest.raises(StageError, match="nests brackets deeper than 256"):
            open_as_it_is(root)
    else:
        assert open_as_it_is(root).GetPrimAtPath("/A")
