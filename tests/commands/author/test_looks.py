"""Materials of the library on craft of others: by a table, by names, in both looks, in metres, seen by every reader."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

from spin_usd.basics.resources import stages
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError
from spin_usd.geometry.box_projection import Polygons, stretch
from spin_usd.scene.texture import Texture
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.craft import CRAFT, PLAIN, craft_in
from tests.cases.root_layers import over_stage

POSES = stages() / "examples" / "tango_speedplus_poses.json"


@pytest.fixture
def craft(tmp_path: Path) -> Path:
    return craft_in(tmp_path)


def author(target: Path | str, out: Path, **options: Any) -> Any:
    return author_stage(poses=POSES, target=target, camera="speedplus", out=out, frames="0:1", **options)


def materials_of(root: Path | str, **selections: str) -> dict[str, Any]:
    """The first picture's materials by their prims' names, with these variants selected."""
    text = "\n".join(f'string {name} = "{variant}"' for name, variant in selections.items())
    path = Path(root).parent / f"selected_{'_'.join(selections.values())}.usda"
    path.write_text(over_stage(frames=1, metadata=f"variants = {{\n{text}\n}}"))
    reader = StageReader(path)
    target = reader.scene(reader.frames[0]).bodies[0].target
    used = {int(i) for shape in target.mesh.shapes for i in np.unique(shape.face_material)}
    return {target.materials[i].path.rpartition("/")[2]: target.materials[i] for i in used}


def table(tmp_path: Path, *rows: str) -> Path:
    path = tmp_path / "table.csv"
    path.write_text("\n".join(("pattern,material,color,scale", *rows)))
    return path


def test_a_table_puts_materials_on_what_its_patterns_match(craft: Path, tmp_path: Path) -> None:
    rows = table(tmp_path, "Bus,gold_foil,,", "solar*,solar_cell,,0.5", "red,white_paint,#ff8000,")
    report = author(craft, tmp_path / "out", materials=rows)
    found = materials_of(report.root)
    assert set(found) == {"gold_foil", "solar_cell", "white_paint", "Flag"}
    assert isinstance(found["gold_foil"].normal, Texture)
    assert found["white_paint"].diffuse_color == pytest.approx((1.0, 0.2158605, 0.0), abs=1e-6)
    own = materials_of(author(craft, tmp_path / "usual", materials=table(tmp_path, "solar*,solar_cell,,")).root)
    sizes = [each["solar_cell"].diffuse_color.coordinates.matrix for each in (found, own)]
    np.testing.assert_allclose(sizes[0], 2 * np.array(sizes[1]), rtol=1e-6)
    assert not [finding for finding in check_stage(Path(report.root)) if finding.severity == "error"]


def test_plain_is_the_same_in_matt_and_rich_is_as_authored(craft: Path, tmp_path: Path) -> None:
    rows = table(tmp_path, "Bus,gold_foil,,", "solar*,solar_cell,,")
    root = author(craft, tmp_path / "out", materials=rows).root
    usual, plain, rich = (materials_of(root, **at) for at in ({}, {"materials": "plain"}, {"materials": "rich"}))
    assert usual == rich
    assert set(plain) == set(usual)
    for name, material in plain.items():
        assert (material.metallic, material.roughness, material.clearcoat, material.ior) == (0, 1, 0, 1)
        assert material.normal is None
        assert material.diffuse_color == usual[name].diffuse_color


def test_auto_says_what_it_took_for_what_and_its_table_does_the_same(craft: Path, tmp_path: Path) -> None:
    report = author(craft, tmp_path / "auto", materials="auto")
    written = tmp_path / "auto" / "materials.csv"
    rows = {row["pattern"]: row for row in csv.DictReader(written.open())}
    assert {name: row["material"] for name, row in rows.items()} == {
        "Bus": "gold_foil", "solar_panel": "solar_cell", "Red": "white_paint", "Flag": "keep",
    }  # fmt: skip
    assert rows["solar_panel"]["note"] == "solar in solar_panel"
    assert any("materials.csv" in note for note in report.notes)
    assert not any("want of knowledge" in note for note in report.notes)
    again = author(craft, tmp_path / "again", materials=written)
    assert materials_of(again.root) == materials_of(report.root)
    for each in ("craft.usda", "craft_looks/finishes.usda", "craft_looks/coordinates.usdc"):
        one, other = (tmp_path / out / "targets" / each for out in ("auto", "again"))
        assert one.read_bytes() == other.read_bytes()


def test_what_neither_name_nor_colour_tells_is_white_paint_with_a_note(craft: Path, tmp_path: Path) -> None:
    strange = (("radiator", "lid"), ("(0.7, 0.05, 0.05)", "(0, 0.7, 0.75)"), ("Red", "Mat1"))
    for old, new in strange:
        craft.write_text(craft.read_text().replace(old, new))
    report = author(craft, tmp_path / "auto", materials="auto")
    (note,) = [note for note in report.notes if "want of knowledge" in note]
    assert "1 surface of Mat1" in note
    assert materials_of(report.root)["white_paint"].diffuse_color[0] > 0.5


def test_coordinates_are_in_metres_on_every_surface_and_foreign_ones_stay(craft: Path, tmp_path: Path) -> None:
    root = author(craft, tmp_path / "out", materials="auto").root
    stage = Usd.Stage.Open(str(root))
    model = stage.GetPrimAtPath("/World/Target/Model")
    meshes = [UsdGeom.Mesh(prim) for prim in Usd.PrimRange(model) if prim.IsA(UsdGeom.Mesh)]
    assert {mesh.GetPrim().GetName() for mesh in meshes} == {"Bus", "Deck", "solar_panel"}
    for mesh in meshes:
        polygons = Polygons(
            points=np.array(mesh.GetPointsAttr().Get(), float) * 0.01,
            counts=np.array(mesh.GetFaceVertexCountsAttr().Get()),
            indices=np.array(mesh.GetFaceVertexIndicesAttr().Get()),
        )
        primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        st = np.array(primvar.ComputeFlattened(), float)
        if mesh.GetPrim().GetName() == "Deck":  # its flag keeps the coordinates that it has
            np.testing.assert_array_equal(st[4:], [(3, 0), (0.5, 0.5), (3, 3)])
            np.testing.assert_allclose(stretch(polygons, st)[0], 1, rtol=1e-5)
        else:
            np.testing.assert_allclose(stretch(polygons, st), 1, rtol=1e-5)
        for subset in UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets():
            bound = UsdShade.MaterialBindingAPI(subset).ComputeBoundMaterial()[0].GetPath().name
            assert bound == {"radiator": "white_paint", "flag": "Flag"}[subset.GetPrim().GetName()]


def test_what_has_no_material_is_grey_and_rich_alone_shines(tmp_path: Path) -> None:
    (tmp_path / "craft.usda").write_text(PLAIN)
    root = author(tmp_path / "craft.usda", tmp_path / "out").root
    assert [each.diffuse_color for each in materials_of(root).values()] == [(0.18, 0.18, 0.18)]
    (plain,) = materials_of(root, materials="plain").values()
    assert (plain.diffuse_color, plain.ior) == (pytest.approx((0.18, 0.18, 0.18)), 1)
    assert set(materials_of(root, materials="rich")) == {"gold_foil", "solar_cell"}


def test_materials_may_stand_in_the_parts_table(craft: Path, tmp_path: Path) -> None:
    parts = tmp_path / "parts.csv"
    parts.write_text("pattern,part,class,material\nBus,bus,body,silver_foil\nsolar*,wing,panel,\nred,lid,,keep\n")
    found = materials_of(author(craft, tmp_path / "out", parts=parts).root)
    assert set(found) == {"silver_foil", "", "Red", "Flag"}


def test_parts_go_by_the_names_of_the_models_own_materials(craft: Path, tmp_path: Path) -> None:
    parts = tmp_path / "parts.csv"
    parts.write_text("pattern,part,class\nRed,lid,radiator\n")
    report = author(craft, tmp_path / "out", parts=parts, materials=table(tmp_path, "Red,silver_foil,,"))
    assert "silver_foil" in materials_of(report.root)
    reader = StageReader(report.root)
    named = {part.name: part.class_name for part in reader.scene(reader.frames[0]).bodies[0].target.parts}
    assert named["lid"] == "radiator"


def test_a_table_of_materials_beats_those_of_the_parts(craft: Path, tmp_path: Path) -> None:
    parts = tmp_path / "parts.csv"
    parts.write_text("pattern,part,class,material\nBus,bus,body,silver_foil\n")
    report = author(craft, tmp_path / "out", parts=parts, materials=table(tmp_path, "Bus,gold_foil,,"))
    assert "gold_foil" in materials_of(report.root)


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("Bus,gold_foli,,", "no material 'gold_foli'; did you mean gold_foil"),
        ("Bus,gold_foil,1 2,", "color = '1 2'; give three numbers"),
        ("Bus,gold_foil,,0", "scale = '0'; give a factor"),
        ("Buss,gold_foil,,", "'Buss' matches nothing; the materials are"),
        ("Bus,,,", "no 'material'"),
        ("Bus,keep,#ff0000,", "has a color, but no material"),
    ],
)
def test_a_wrong_row_is_told_and_nothing_is_left(craft: Path, tmp_path: Path, row: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        author(craft, tmp_path / "out", materials=table(tmp_path, row))
    assert not (tmp_path / "out").exists()


def test_a_group_whose_material_beats_those_below_gives_way_and_the_rest_keeps_it(craft: Path, tmp_path: Path) -> None:
    stronger = 'rel material:binding = </Craft/Red> ( bindMaterialAs = "strongerThanDescendants" )'
    applied = 'def Xform "Craft" ( prepend apiSchemas = ["MaterialBindingAPI"] )'
    craft.write_text(CRAFT.replace('def Xform "Craft"\n{', f"{applied}\n{{\n{stronger}"))
    report = author(craft, tmp_path / "out", materials=table(tmp_path, "Bus,gold_foil,,"))
    assert set(materials_of(report.root)) == {"gold_foil", "Red"}


def bound(purpose: str, name: str) -> str:
    return f"rel material:binding{purpose} = </Craft/{name}>"


@pytest.mark.parametrize("purpose", [":full", ":preview"])
def test_a_material_for_one_purpose_gives_way_wherever_it_is_bound(craft: Path, tmp_path: Path, purpose: str) -> None:
    applied = 'def Xform "Craft" ( prepend apiSchemas = ["MaterialBindingAPI"] )'
    craft.write_text(CRAFT.replace('def Xform "Craft"\n{', f"{applied}\n{{\n{bound(purpose, 'Red')}"))
    report = author(craft, tmp_path / "out", materials=table(tmp_path, "Bus,gold_foil,,", "radiator,white_paint,,"))
    assert {"gold_foil", "white_paint"} <= set(materials_of(report.root))


def test_a_material_for_full_renders_is_the_one_that_is_seen(craft: Path, tmp_path: Path) -> None:
    applied = 'def Xform "Craft" ( prepend apiSchemas = ["MaterialBindingAPI"] )'
    craft.write_text(CRAFT.replace('def Xform "Craft"\n{', f"{applied}\n{{\n{bound(':full', 'Red')}"))
    author(craft, tmp_path / "out", materials="auto")
    rows = csv.DictReader((tmp_path / "out" / "materials.csv").open())
    patterns = {row["pattern"] for row in rows}
    assert "Red" in patterns
    assert "Flag" not in patterns


def test_a_collection_keeps_what_it_binds(craft: Path, tmp_path: Path) -> None:
    applied = 'def Xform "Craft" ( prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:all"] )'
    collection = 'uniform token collection:all:expansionRule = "expandPrims"\n'
    collection += "rel collection:all:includes = </Craft/Bus>\n"
    collection += "rel material:binding:collection:all = [</Craft.collection:all>, </Craft/Red>]"
    craft.write_text(CRAFT.replace('def Xform "Craft"\n{', f"{applied}\n{{\n{collection}"))
    with pytest.raises(InputError, match="a collection binds the material of Bus"):
        author(craft, tmp_path / "out", materials=table(tmp_path, "Bus,gold_foil,,"))
    assert "Red" in materials_of(author(craft, tmp_path / "auto", materials="auto").root)


def test_looks_of_other_names_do_no_harm_where_nothing_is_asked(tmp_path: Path) -> None:
    sets = 'variantSet "look" = { "red" { } "blue" { } }'
    (tmp_path / "craft.usda").write_text(
        PLAIN.replace('def Xform "Craft"\n{', f'def Xform "Craft" (variantSets = "look")\n{{\n{sets}')
    )
    assert len(materials_of(author(tmp_path / "craft.usda", tmp_path / "out").root)) == 1


def test_looks_of_other_names_are_refused(craft: Path, tmp_path: Path) -> None:
    craft.write_text(CRAFT.replace('def Xform "Craft"\n{', 'def Xform "Craft" (variantSets = "look")\n{\n'
                                   'variantSet "look" = { "red" { } "blue" { } }'))  # fmt: skip
    with pytest.raises(InputError, match="variant set look of blue, red"):
        author(craft, tmp_path / "out", materials="auto")


def test_tango_takes_materials_too(tmp_path: Path) -> None:
    rows = table(tmp_path, "GoldMli,silver_foil,,")
    root = author("tango", tmp_path / "out", materials=rows).root
    assert {"silver_foil", "SolarCell"} < set(materials_of(root))
    assert "GoldMli" not in materials_of(root)
    assert materials_of(root, materials="plain")["SolarCell"].ior == 1
