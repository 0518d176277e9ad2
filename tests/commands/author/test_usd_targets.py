"""USD files of others as targets: whatever their roots are, what is rendered has the size that the file says."""

import base64
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from pxr import Sdf, Usd, UsdUtils

from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError, StageError
from spin_usd.scene.scene import Scene
from spin_usd.scene.texture import Texture
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.composition.copy_stage import copy_stage
from spin_usd.stage.read.stage_reader import StageReader

POSES = [{"filename": "img000000.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 50]}]
FLOAT32 = 1e-6
CUBE = 'def Cube "C"\n{\n double size = 200\n}\n'
"""Two metres across, in centimetres."""


@pytest.fixture
def authored(tmp_path: Path) -> Any:
    """Author a stage on the target file, or on a layer of that text; returns the report."""
    (tmp_path / "poses.json").write_text(json.dumps(POSES))

    def author(target: Path | str, **options: Any) -> Any:
        if isinstance(target, str):
            (tmp_path / "models").mkdir(exist_ok=True)
            (tmp_path / "models" / "craft.usda").write_text(target)
            target = tmp_path / "models" / "craft.usda"
        made = {"poses": tmp_path / "poses.json", "camera": "speedplus", "out": tmp_path / "stage"}
        return author_stage(target=target, **made | options)

    return author


def layer(body: str, *, default: str = "W", metadata: str = "metersPerUnit = 0.01") -> str:
    named = f'defaultPrim = "{default}"' if default else ""
    return f'#usda 1.0\n(\n {named}\n upAxis = "Y"\n {metadata}\n)\n{body}'


def first_scene(root: str) -> Scene:
    reader = StageReader(root)
    return reader.scene(reader.frames[0])


def size(root: str) -> list[float]:
    """Of the target's box along its axes, metres, as a renderer gets it."""
    mesh = first_scene(root).bodies[0].target.mesh
    return list(np.ptp(mesh.points[np.unique(mesh.faces)], axis=0))


@pytest.mark.parametrize("kind", ["", "Scope", "Xform", "SkelRoot"])
def test_a_root_of_any_type_is_scaled_by_its_own_unit(authored: Any, kind: str) -> None:
    report = authored(layer(f'def {kind} "W"\n{{\n{CUBE}}}\n'))
    assert size(report.root) == pytest.approx([2, 2, 2], rel=FLOAT32)


def as_floats(path: Path) -> None:
    """Let the crate file's one inlined double be a float, as exporters of others store it.

    Source: the type's number in USD's crateDataTypes.h is 9 for double, 8 for float; bit 62 says that it is inlined.
    """
    data = path.read_bytes()
    assert data.count(b"\x09\x40") == 1
    path.write_bytes(data.replace(b"\x09\x40", b"\x08\x40"))


def crate(path: Path, name: str, value: float) -> Path:
    """A file of a cube whose one number in the root metadata, `name`, is a float."""
    made = Sdf.Layer.CreateAnonymous(".usdc")
    cube = Sdf.CreatePrimInLayer(made, "/W")
    cube.specifier, cube.typeName = Sdf.SpecifierDef, "Cube"
    made.pseudoRoot.SetInfo(name, value)
    made.defaultPrim = "W"
    made.Export(str(path))
    as_floats(path)
    return path


def test_a_unit_that_is_stored_as_a_float_is_read(authored: Any, tmp_path: Path) -> None:
    report = authored(crate(tmp_path / "craft.usdc", "metersPerUnit", 0.5))
    assert size(report.root) == pytest.approx([1, 1, 1], rel=FLOAT32)


@pytest.mark.parametrize("name", ["timeCodesPerSecond", "framesPerSecond"])
def test_a_layer_that_usd_itself_cannot_read_is_one_sentence(authored: Any, tmp_path: Path, name: str) -> None:
    with pytest.raises(StageError, match="USD cannot read it"):
        authored(crate(tmp_path / "craft.usdc", name, 0.5), units_per_metre=2)


ROUNDED = """def Xform "W"
{
    quath xformOp:orient = (0.7071, 0.7071, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:orient"]
    def Mesh "M"
    {
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 0), (100, 0, 0), (0, 50, 0)]
    }
    def Mesh "Empty"
    {
    }
}
"""


def test_what_is_rendered_otherwise_is_noted_and_the_size_agrees(authored: Any) -> None:
    report = authored(layer(ROUNDED))
    assert size(report.root) == pytest.approx([1, 0, 0.5], abs=2 * FLOAT32)
    about = [note.split(": ")[1][:20] for note in report.notes if note.startswith("/")]
    assert sorted(about) == ["holds a quaternion w", "is a mesh without fa"]


FALLBACK = """def Xform "W"
{
    def Cube "C" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        rel material:binding = </W/Paint>
    }
    def Material "Paint"
    {
        token outputs:surface.connect = </W/Paint/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </W/Paint/Picture.outputs:rgb>
            token outputs:surface
        }
        def Shader "Picture"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./none.png@
            FALLBACK
            float3 outputs:rgb
        }
    }
}
"""


def test_a_missing_image_with_a_fallback_travels_as_far_as_the_pictures(authored: Any, tmp_path: Path) -> None:
    report = authored(layer(FALLBACK.replace("FALLBACK", "float4 inputs:fallback = (0.25, 0.5, 0.75, 1)")))
    assert any("@./none.png@ does not exist: its fallback is rendered" in note for note in report.notes)
    copied = copy_stage(report.root, tmp_path / "copy")
    assert first_scene(str(copied)).bodies[0].target.materials[0].diffuse_color == (0.25, 0.5, 0.75)


def test_a_missing_image_without_one_is_refused(authored: Any) -> None:
    with pytest.raises(InputError, match="depends on 1 missing files"):
        authored(layer(FALLBACK.replace("FALLBACK", "")))


def test_a_plan_tells_what_a_stage_renders_otherwise(authored: Any, spin_usd: Any) -> None:
    report = authored(layer('def Xform "W"\n{\n def Cube "C"\n {\n }\n def Mesh "Empty"\n {\n }\n}\n'))
    planned = spin_usd("plan", report.root, "--renderer", "raycast")
    assert "note: /World/Target/Model/Empty: is a mesh without faces" in planned.stderr


ROOTS = """def Xform "Body"
{
    double3 xformOp:translate = (300, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Cube "C" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        double size = 200
        rel material:binding = </Looks/Paint>
    }
}
def "Boom" (
    instanceable = true
    references = </Shape>
)
{
}
def Scope "Looks"
{
    def Material "Paint"
    {
        token outputs:surface.connect = </Looks/Paint/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.25, 0.5, 0.75)
            token outputs:surface
        }
    }
}
class Xform "Shape"
{
    def Cube "C"
    {
        double size = 100
        color3f[] primvars:displayColor = [(1, 0, 0)]
    }
}
def Camera "View"
{
}
"""
PIXEL = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP438AAAAQBAYDFKhhdAAAAAElFTkSuQmCC"
"""A PNG image of one pixel."""
PAINT, RED = (0.25, 0.5, 0.75), (1.0, 0.0, 0.0)


def shown(root: str) -> dict[str, tuple[tuple[float, ...], list[float]]]:
    """By the end of its path, each part's colour and the least and greatest x of its box, metres."""
    target = first_scene(root).bodies[0].target
    found = {}
    for part in target.parts:
        faces = np.flatnonzero(target.mesh.face_part == part.id)
        x = target.mesh.points[target.mesh.faces[faces]][..., 0]
        color: Any = target.materials[target.mesh.face_material[faces[0]]].diffuse_color
        found[part.path.split("/Model/")[1]] = (color, [float(x.min()), float(x.max())])
    return found


def test_without_a_default_prim_all_roots_are_the_target(authored: Any) -> None:
    report = authored(layer(ROOTS, default=""))
    assert shown(report.root) == {"Body/C": (PAINT, [2, 4]), "Boom/C": (RED, [-0.5, 0.5])}
    assert report.notes[:-1] == (
        "no defaultPrim: all 2 root prims with geometry are the target (/Body, /Boom); --prim chooses one",
    )
    assert {finding.severity for finding in check_stage(report.root)} <= {"warning"}


def test_a_root_comes_with_the_materials_beside_it(authored: Any) -> None:
    """As the default prim: nothing else of the file is rendered."""
    report = authored(layer(ROOTS, default="Body"))
    assert shown(report.root) == {"Body/C": (PAINT, [2, 4])}
    assert [note for note in report.notes if "body axes" not in note] == []


@pytest.mark.parametrize(
    ("prim", "expected"),
    [
        ("/Body", {"Body/C": (PAINT, [2, 4])}),
        ("/Body/C", {"C": (PAINT, [-1, 1])}),
        ("/Boom", {"C": (RED, [-0.5, 0.5])}),
        ("/", {"Body/C": (PAINT, [2, 4]), "Boom/C": (RED, [-0.5, 0.5])}),
    ],
)
@pytest.mark.parametrize("default", ["", "Body"])
def test_a_prim_is_chosen_as_a_reference_to_it_would(authored: Any, default: str, prim: str, expected: Any) -> None:
    assert shown(authored(layer(ROOTS, default=default), prim=prim).root) == expected


def test_what_roots_name_travels_also_out_of_a_package(authored: Any, tmp_path: Path) -> None:
    """The image is found within the package by the layer that gathers its roots."""
    (tmp_path / "none.png").write_bytes(base64.b64decode(PIXEL))
    text = FALLBACK.replace("FALLBACK", "") + 'def Cube "Other"\n{\n double size = 400\n}\n'
    (tmp_path / "craft.usda").write_text(layer(text, default=""))
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "craft.usda"), str(tmp_path / "craft.usdz"))
    report = authored(tmp_path / "craft.usdz")
    (tmp_path / "none.png").unlink()
    copied = copy_stage(report.root, tmp_path / "copy")
    assert size(str(copied)) == pytest.approx([4, 4, 4], rel=FLOAT32)
    assert "none.png" in {
        value.image.name
        for material in first_scene(str(copied)).bodies[0].target.materials
        for value in vars(material).values()
        if isinstance(value, Texture)
    }


@pytest.mark.parametrize("out", ["made/stage", "link/stage"])
def test_roots_find_their_images_in_a_stage_made_by_way_of_a_relative_path_or_a_link(
    authored: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, out: str
) -> None:
    (tmp_path / "made").mkdir()
    (tmp_path / "link").symlink_to("made")
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "none.png").write_bytes(base64.b64decode(PIXEL))
    text = FALLBACK.replace("FALLBACK", "") + 'def Cube "Other"\n{\n double size = 400\n}\n'
    monkeypatch.chdir(tmp_path)
    for folder in (Path(), tmp_path):
        report = authored(layer(text, default=""), out=folder / out)
        assert size(report.root) == pytest.approx([4, 4, 4], rel=FLOAT32)
        shutil.rmtree(out)


@pytest.mark.parametrize(
    ("body", "options", "saying"),
    [
        (
            ROOTS,
            {"prim": "/None"},
            r"has no prim '/None'; choose /Body, /Boom, /Looks, /View, a prim below, or / for all",
        ),
        (ROOTS, {"prim": "Body"}, "has no prim 'Body'"),
        (ROOTS, {"prim": "/Looks"}, "its prim /Looks holds no geometry; choose one that does"),
        (ROOTS.replace("= </Looks/Paint>", "= </Looks/None>"), {"prim": "/Body"}, "/Looks/None, which is not there"),
        ("", {}, "holds no geometry"),
    ],
)
def test_a_prim_that_cannot_be_the_target_is_told(authored: Any, body: str, options: Any, saying: str) -> None:
    with pytest.raises(InputError, match=saying):
        authored(layer(body, default=""), **options)


def test_a_prim_of_a_file_without_prims_is_told(authored: Any, tmp_path: Path) -> None:
    trimesh.creation.box((2, 3, 4)).export(tmp_path / "box.stl")
    with pytest.raises(InputError, match="only USD files have prims"):
        authored(tmp_path / "box.stl", prim="/Box", units_per_metre=1)


def test_lights_of_the_targets_own_file_are_reported(authored: Any) -> None:
    body = 'def Xform "W"\n{\n def Cube "C"\n {\n }\n def SphereLight "Lamp"\n {\n }\n}\n'
    assert "1 light of the target's own file shines in every picture (/W/Lamp)" in authored(layer(body)).notes


def test_a_file_named_with_backslashes_is_found(authored: Any, tmp_path: Path) -> None:
    (tmp_path / "models" / "textures").mkdir(parents=True)
    (tmp_path / "models" / "textures" / "a.png").write_bytes(base64.b64decode(PIXEL))
    text = layer(FALLBACK.replace("FALLBACK", "").replace("./none.png", ".\\textures\\a.png"))
    report = authored(text)
    copied = copy_stage(report.root, tmp_path / "copy")
    color = first_scene(str(copied)).bodies[0].target.materials[0].diffuse_color
    assert isinstance(color, Texture)
    assert color.image.name == "a.png"
    assert (tmp_path / "models" / "craft.usda").read_text() == text
    assert "\\textures" in Sdf.Layer.FindOrOpen(str(tmp_path / "models" / "craft.usda")).ExportToString()


LEFT_OUT = {
    "mdl_only.usda": "files that only shaders of other renderers name are missing, and left out: OmniPBR.mdl, d.png",
    "primvar_counts/const.usda": "primvars:st: holds 4 values, constant interpolation needs 1, and is left out",
    "primvar_counts/five.usda": "primvars:st: holds 5 values, vertex interpolation needs 4, and is left out",
    "units_differ/craft.usda": "wing.usda has metersPerUnit 0.01, its root layer 1.0",
    "instancer_colours.usda": "/World/Target/Model/PI colours each instance by displayColor",
}


@pytest.mark.parametrize("name", LEFT_OUT)
def test_what_of_a_strangers_target_is_not_shown_is_told(authored: Any, shared: Path, tmp_path: Path, name) -> None:
    """And the stage can be rendered and shared: its copy holds all that it names."""
    report = authored(shared / "data" / "strangers" / name, any_size=True)
    assert any(LEFT_OUT[name] in note for note in report.notes), report.notes
    copy_stage(report.root, tmp_path / "copy")
    assert len(StageReader(report.root).frames) == 1


def test_tiles_of_two_folders_are_each_its_own(authored: Any, shared: Path, tmp_path: Path) -> None:
    """USD looks for a name without ./ beside the root layer first, and finds there what another layer means."""
    folder = shared / "data" / "strangers" / "udim"
    authored(folder / "craft_nu.usda", any_size=True)
    wanted = {file.read_bytes() for part in ("bus", "wing") for file in (folder / part / "tex").glob("a.100*.png")}
    assert {file.read_bytes() for file in (tmp_path / "stage").rglob("a.100*.png")} == wanted


def test_a_variant_set_without_a_selection_is_named_and_can_be_given_one(authored, shared, tmp_path) -> None:
    folder = shared / "data" / "strangers" / "variant_set_unselected"
    with pytest.raises(InputError, match=r"holds no geometry; .* have no selection: give --variant") as told:
        authored(folder / "craft.usda", any_size=True)
    assert str(told.value).endswith("give --variant model=full or --variant model=lite")
    for given, size in (("model=full", 2), ("model=lite", 1)):
        report = authored(folder / "craft.usda", any_size=True, variant=[given], out=tmp_path / given)
        reader = StageReader(report.root)
        assert np.ptp(reader.bodies.target_at(reader.frames[0].time_code).mesh.box, axis=0).max() == pytest.approx(size)


@pytest.mark.parametrize(("given", "saying"), [("no=full", "has no variant no=full"), ("model", "is not SET=NAME")])
def test_a_variant_that_is_not_there_is_refused(authored: Any, shared: Path, given: str, saying: str) -> None:
    with pytest.raises(InputError, match=saying):
        authored(shared / "data" / "strangers" / "variant_set_unselected" / "craft.usda", variant=[given])


@pytest.mark.parametrize(("given", "said"), [("look=matt", 1), ("look=reflective", 0)])
def test_a_variant_that_the_preset_replaces_is_said(tmp_path: Path, given: str, said: int) -> None:
    """What is shown is the preset's."""
    options = {"target": "tango", "preset": "spin_lightbox", "variant": [given], "camera": "speedplus"}
    report = author_stage(sample="range=8 count=1", out=tmp_path / "stage", **options)
    stage = Usd.Stage.Open(str(report.root))
    look = stage.GetPrimAtPath("/World/Target/Model").GetVariantSet("look")
    assert look.GetVariantSelection() == "reflective"
    notes = [note for note in report.notes if "--variant" in note]
    wanted = f"the preset spin_lightbox selects look=reflective, in place of --variant {given}: leave one of them out"
    assert notes == [wanted] * said


@pytest.mark.parametrize("preset", ["lightbox", "sunlamp"])
@pytest.mark.parametrize(("target", "look"), [("tango", "mockup"), ("cubesat", "reflective")])
def test_a_look_that_the_target_lacks_stays_its_own(tmp_path: Path, preset: str, target: str, look: str) -> None:
    """The presets of the test beds select Tango's mock-up, and are used with any craft."""
    options = {"target": target, "preset": preset, "camera": "speedplus"}
    report = author_stage(sample="range=8 count=1", out=tmp_path / "stage", **options)
    stage = Usd.Stage.Open(str(report.root))
    assert stage.GetPrimAtPath("/World/Target/Model").GetVariantSet("look").GetVariantSelection() == look
    wanted = f"the preset {preset} selects look=mockup, which the target lacks: its own stays (of matt, reflective)"
    assert [note for note in report.notes if "look=" in note] == [wanted] * (target == "cubesat")
