"""Opening, variants, the rules for paths, hashes that do not depend on the place, relocatable copies."""

import os
import shutil
import subprocess
import sys
import time

import pytest
from pxr import Sdf, Usd

from spin_usd.errors import OutputError, StageError
from spin_usd.stage.composition.copy_stage import copy_stage
from spin_usd.stage.composition.open_stage import open_stage, variants
from spin_usd.stage.composition.stage_hash import selected_variant, stage_hash, used_files
from spin_usd.stage.read.stage_reader import StageReader

ROOT = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
    {layers}
)

def Xform "World" (
    {selection}
    prepend variantSets = "augmentation"
)
{{
    def "Model" (
        prepend references = @./parts/model.usda@
    )
    {{
    }}

    variantSet "augmentation" = {{
        "big" {{
            over "Model"
            {{
                double size = 5
            }}
        }}
        "small" {{
            over "Model"
            {{
                double size = 1
            }}
        }}
        {more}
    }}
}}
"""
MODEL = """#usda 1.0
(
    defaultPrim = "Model"
)

def Cube "Model"
{
    double size = 3
    asset texture = @./textures/paint.png@
}
"""


@pytest.fixture
def make(tmp_path):
    def write(folder="stage", *, layers="", selection="", more="", model=MODEL):
        home = tmp_path / folder
        (home / "parts" / "textures").mkdir(parents=True)
        (home / "parts" / "textures" / "paint.png").write_bytes(b"not really a picture")
        (home / "parts" / "model.usda").write_text(model)
        (home / "root.usda").write_text(ROOT.format(layers=layers, selection=selection, more=more))
        return home / "root.usda"

    return write


def size(stage):
    return stage.GetPrimAtPath("/World/Model").GetAttribute("size").Get()


def test_nominal_is_the_stage_without_augmentation(make) -> None:
    path = make()
    stage = open_stage(path)
    assert size(stage) == 3
    assert variants(stage) == ("nominal", "big", "small")
    assert selected_variant(stage) == "nominal"


def test_nominal_clears_a_selection_that_the_stage_authors(make) -> None:
    """The cube's own size, and the same content as in a stage that authors no selection."""
    path = make("b", selection='variants = {\nstring augmentation = "big"\n}')
    assert size(Usd.Stage.Open(str(path))) == 5
    stage = open_stage(path)
    assert (size(stage), selected_variant(stage)) == (3, "nominal")
    assert stage_hash(stage) == stage_hash(open_stage(make("c")))
    assert size(open_stage(path, variant="big")) == 5


def test_a_selection_without_its_variant_set_is_no_variant(tmp_path) -> None:
    path = tmp_path / "root.usda"
    path.write_text(
        '#usda 1.0\n(\ndefaultPrim = "A"\n)\ndef "A" (\nvariants = {\nstring augmentation = "x"\n}\n)\n{\n}\n'
    )
    assert selected_variant(open_stage(path)) == "nominal"


@pytest.mark.parametrize("name", ["Tele", "tele-2"])
def test_a_variant_that_cannot_name_a_folder_is_refused(make, name) -> None:
    with pytest.raises(StageError, match=f"has a variant named '{name}', which cannot name a folder"):
        open_stage(make(more=f'"{name}" {{\n}}'))


def test_a_variant_is_selected_without_touching_the_layers(make) -> None:
    path = make()
    before = path.read_bytes()
    stage = open_stage(path, variant="big")
    assert (size(stage), selected_variant(stage)) == (5, "big")
    assert not stage.GetRootLayer().dirty
    assert path.read_bytes() == before


def test_a_variant_called_nominal_is_selected(make) -> None:
    path = make(
        more='"nominal" {\nover "Model"\n{\ndouble size = 7\n}\n}',
        selection='variants = {\nstring augmentation = "big"\n}',
    )
    stage = open_stage(path)
    assert size(stage) == 7
    assert variants(stage) == ("nominal", "big", "small")


def test_an_unknown_variant_lists_the_known_ones(make) -> None:
    with pytest.raises(StageError, match="has no variant 'huge'; choose one of nominal, big, small"):
        open_stage(make(), variant="huge")


@pytest.fixture
def grouped(make):
    """A second set, "paint"; the augmentation "thick" selects thick paint."""
    path = make(more='"thick" (\nvariants = {\nstring paint = "thick"\n}\n)\n{\n}\n')
    thin, thick = (f'"{name}" {{\nover "Model" {{\ndouble coat = {coat}\n}}\n}}' for name, coat in PAINTS.items())
    text = path.read_text().replace('= "augmentation"', '= ["augmentation", "paint"]')
    path.write_text(text[: text.rindex("}")] + f'variantSet "paint" = {{\n{thin}\n{thick}\n}}\n}}\n')
    return path


PAINTS = {"thin": 1, "thick": 2}


@pytest.mark.parametrize(
    ("variant", "selections", "coat"),
    [("nominal", {}, None), ("nominal", {"paint": "thin"}, 1), ("thick", {}, 2), ("thick", {"paint": "thin"}, 1)],
)
def test_another_set_can_be_selected_and_beats_what_an_augmentation_selects(grouped, variant, selections, coat) -> None:
    stage = open_stage(grouped, variant=variant, selections=selections)
    attribute = stage.GetPrimAtPath("/World/Model").GetAttribute("coat")
    assert (attribute.Get() if attribute else None) == coat
    assert not stage.GetRootLayer().dirty


@pytest.mark.parametrize(
    ("selections", "saying"),
    [
        ({"paint": "wet"}, "has no variant 'wet' in its set 'paint'; choose one of thick, thin"),
        ({"colour": "red"}, "has no variant set 'colour' on its default prim; choose one of paint"),
    ],
)
def test_an_unknown_set_or_variant_of_it_lists_the_known_ones(grouped, selections, saying) -> None:
    with pytest.raises(StageError, match=saying):
        open_stage(grouped, selections=selections)


@pytest.mark.parametrize(
    ("named", "saying"),
    [
        ("/etc/passwd", "the absolute path @/etc/passwd@"),
        ("../../outside.usda", "outside the stage's folder"),
        ("./a\0.usda", "which no file is called"),
        ("http://example.com/a.usda", "network and other schemes"),
        ("file:///etc/passwd", "network and other schemes"),
        ("./link.usda", "through a symbolic link"),
        ("./linked/model.usda", "through a symbolic link"),
        ("./pipe.usda", "is not a regular file"),
        ("./parts", "is not a regular file"),
    ],
)
@pytest.mark.parametrize("where", ["sublayer", "unused variant", "texture"])
def test_paths_that_leave_the_stage_are_refused_before_opening(make, tmp_path, named, saying, where) -> None:
    (tmp_path / "outside.usda").write_text(MODEL)
    if where == "sublayer":
        path = make(layers=f"subLayers = [\n@{named}@\n]")
    elif where == "texture":
        path = make(layers="customLayerData = {\n}", more=f'"t" {{\nasset texture = @{named}@\n}}')
    else:
        path = make(more=f'"t" {{\ndef "X" (\nprepend payload = @{named}@\n)\n{{\n}}\n}}')
    home = path.parent
    (home / "link.usda").symlink_to(tmp_path / "outside.usda")
    (home / "linked").symlink_to(home / "parts")
    os.mkfifo(home / "pipe.usda")
    started = time.perf_counter()
    with pytest.raises(StageError, match=saying):
        open_stage(path)
    assert time.perf_counter() - started < 5  # USD hangs on a pipe


@pytest.mark.parametrize(
    ("text", "saying"),
    [
        ("", "is not a USD layer"),
        ("#usda 1.0\n(\n blah", "Expected"),
        ("not usd at all", "is not a USD layer"),
        ("#usda 1.0\n(\nsubLayers = [\n@./root.usda@\n]\n)\n", "does not compose"),
        ('#usda 1.0\ndef "A" (\nprepend references = </B>\n)\n{\n}\n', "does not compose: Unresolved reference"),
        ('#usda 1.0\ndef "A" (\nprepend references = </A>\n)\n{\n}\n', "does not compose: Cycle"),
        ("#usda 1.0\n(\ntimeCodesPerSecond = 0\n)\n", "timeCodesPerSecond is 0"),
    ],
)
def test_stages_that_do_not_compose(tmp_path, text, saying) -> None:
    path = tmp_path / "root.usda"
    path.write_text(text)
    with pytest.raises(StageError, match=saying) as error:
        open_stage(path)
    assert "\n" not in str(error.value)
    assert "root.usda" in str(error.value)


@pytest.mark.parametrize("brackets", ["()", "{}", "[]"])
def test_nesting_that_would_overflow_usds_parser(tmp_path, brackets) -> None:
    path = tmp_path / "root.usda"
    path.write_text("#usda 1.0\n" + brackets[0] * 200_000 + brackets[1] * 200_000)
    with pytest.raises(StageError, match="nests brackets deeper than 256"):
        open_stage(path)
    path.write_text(f'#usda 1.0\n(\ndoc = """{brackets[0] * 300}"""\n)\n# {brackets[0] * 300}\n')
    assert open_stage(path)


def test_files_that_are_no_stage(tmp_path) -> None:
    with pytest.raises(StageError, match="does not exist"):
        open_stage(tmp_path / "none.usda")
    (tmp_path / "model.obj").write_text("")
    with pytest.raises(StageError, match="is not a USD stage"):
        open_stage(tmp_path / "model.obj")
    (tmp_path / "folder.usda").mkdir()
    with pytest.raises(StageError, match="is not a regular file"):
        open_stage(tmp_path / "folder.usda")


def test_too_many_prims(tmp_path, monkeypatch) -> None:
    path = tmp_path / "root.usda"
    path.write_text("#usda 1.0\n" + "\n".join(f'def "P{i}"\n{{\n}}' for i in range(30)))
    monkeypatch.setattr("spin_usd.stage.composition.excess.MAX_PRIMS", 29)
    with pytest.raises(StageError, match="more than 29 prims"):
        open_stage(path)
    monkeypatch.setattr("spin_usd.stage.composition.excess.MAX_PRIMS", 30)
    assert open_stage(path)


def test_the_hash_is_of_the_content_not_the_place(make, tmp_path) -> None:
    path = make()
    moved = tmp_path / "elsewhere" / "deeper"
    shutil.copytree(path.parent, moved)
    assert stage_hash(open_stage(path)) == stage_hash(open_stage(moved / "root.usda"))


def test_the_hash_follows_content_assets_and_variant(make) -> None:
    hashes = [stage_hash(open_stage(make("a")))]
    hashes.append(stage_hash(open_stage(make("b"), variant="big")))
    hashes.append(stage_hash(open_stage(make("c", model=MODEL.replace("size = 3", "size = 4")))))
    path = make("d")
    (path.parent / "parts" / "textures" / "paint.png").write_bytes(b"another picture")
    hashes.append(stage_hash(open_stage(path)))
    assert len(set(hashes)) == 4


def test_the_hash_tells_variants_of_equal_content_apart(make) -> None:
    path = make(more='"same" {\n}\n"alike" {\n}')
    hashes = {stage_hash(open_stage(path, variant=v)) for v in ("nominal", "same", "alike")}
    assert len(hashes) == 3


def test_the_hash_ignores_variants_that_are_not_selected(make) -> None:
    plain = stage_hash(open_stage(make("a")))
    assert plain == stage_hash(open_stage(make("b", more='"huge" {\n}')))


def test_used_files_are_those_of_this_composition(make) -> None:
    path = make(more='"t" {\ndef "X" (\nprepend payload = @./unused.usda@\n)\n{\n}\n}')
    (path.parent / "unused.usda").write_text(MODEL)
    used = used_files(open_stage(path), path.parent)
    assert list(used) == ["parts/model.usda", "parts/textures/paint.png", "root.usda"]
    assert all(len(sha) == 64 for sha in used.values())
    with_variant = used_files(open_stage(path, variant="t"), path.parent)
    assert set(with_variant) - set(used) == {"unused.usda"}


def test_a_copy_keeps_bytes_and_hash_and_holds_all_variants(make, tmp_path) -> None:
    path = make(more='"t" {\ndef "X" (\nprepend payload = @./other/unused.usda@\n)\n{\n}\n}')
    (path.parent / "other" / "textures").mkdir(parents=True)
    (path.parent / "other" / "unused.usda").write_text(MODEL)
    (path.parent / "other" / "textures" / "paint.png").write_bytes(b"x")
    (path.parent / "stray.txt").write_text("not part of the stage")
    copy = copy_stage(path, tmp_path / "copy")
    files = {p.relative_to(path.parent) for p in path.parent.rglob("*") if p.is_file()}
    copied = {p.relative_to(copy.parent) for p in copy.parent.rglob("*") if p.is_file()}
    assert {str(f) for f in files - copied} == {"stray.txt"}
    assert all((copy.parent / f).read_bytes() == (path.parent / f).read_bytes() for f in copied)
    for variant in ("nominal", "big", "t"):
        a, b = (open_stage(p, variant=variant) for p in (path, copy))
        assert stage_hash(a) == stage_hash(b)


def test_a_copy_that_cannot_be_written_is_one_sentence(make, tmp_path) -> None:
    """A limit on the size of a file stands for a full disk: both fail the write call."""
    path = make(model=MODEL + "#" * 4000)
    code = (
        "import resource, signal; from spin_usd.stage.composition.copy_stage import copy_stage;"
        "from spin_usd.errors import OutputError; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))\n"
        f"try: copy_stage({str(path)!r}, {str(tmp_path / 'copy')!r})\n"
        "except OutputError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.startswith(f"{tmp_path}/copy/parts/model.usda: cannot be written (File too large); free"), done
    assert done.stdout.count("\n") == 1
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        copy_stage(path, tmp_path / "file")


def test_a_copy_is_whole_or_not_at_all(make, tmp_path) -> None:
    path = make()
    (path.parent / "parts" / "textures" / "paint.png").unlink()
    with pytest.raises(StageError, match=r"@./textures/paint.png@ named by .*model.usda is missing"):
        copy_stage(path, tmp_path / "copy")
    assert not (tmp_path / "copy").exists()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("")
    with pytest.raises(OutputError, match="not empty"):
        copy_stage(make("b"), tmp_path / "full")


def test_a_package_may_not_name_what_lies_outside(tmp_path) -> None:
    (tmp_path / "secret.usda").write_text(MODEL)
    inside = tmp_path / "inner.usda"
    inside.write_text(f'#usda 1.0\ndef "A" (\nprepend references = @{tmp_path}/secret.usda@\n)\n{{\n}}\n')
    package = tmp_path / "package.usdz"
    writer = Sdf.ZipFileWriter.CreateNew(str(package))
    writer.AddFile(str(inside), "inner.usda")
    assert writer.Save()
    with pytest.raises(StageError, match="outside its package"):
        open_stage(package)
    good = tmp_path / "good.usdz"
    (tmp_path / "plain.usda").write_text(MODEL)
    writer = Sdf.ZipFileWriter.CreateNew(str(good))
    writer.AddFile(str(tmp_path / "plain.usda"), "plain.usda")
    assert writer.Save()
    stage = open_stage(good)
    assert stage.GetPrimAtPath("/Model")
    assert list(used_files(stage, tmp_path)) == ["good.usdz"]


def test_no_target_and_a_target_in_another(make_stage) -> None:
    path = make_stage()
    path.write_text(path.read_text().replace('prepend apiSchemas = ["SpinTargetAPI"]', ""))
    with pytest.raises(StageError, match="the stage has no target; apply SpinTargetAPI"):
        StageReader(path)
    inner = 'def Cube "Inner" (\nprepend apiSchemas = ["SpinTargetAPI"]\n)\n{\n}'
    with pytest.raises(StageError, match="Target/Inner: is a target below the target /World/Target"):
        StageReader(make_stage(inner, name="b.usda"))
