"""STEP: a box of AP214, written here, comes in metres whatever its unit, in its own axes, under its own name."""

import itertools
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.commands.author.model import model_file
from spin_usd.errors import InputError, MissingPackageError, SpinError
from spin_usd.formats.mesh.step_file import convert_step
from spin_usd.scene.converted_model import ModelToConvert
from spin_usd.stage.read.stage_reader import StageReader

POSES = [{"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 20]}]
MILLIMETRE, METRE = "SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"


class StepText(list[str]):
    """The lines of a STEP file; `add` returns how others refer to a new one."""

    def add(self, text: str) -> str:
        self.append(f"#{len(self) + 1}={text};")
        return f"#{len(self)}"

    def triple(self, kind: str, values: Sequence[float]) -> str:
        return self.add(f"{kind}('',({','.join(str(float(each)) for each in values)}))")

    def axes(self, origin: Sequence[float], z: Sequence[float], x: Sequence[float]) -> str:
        point = self.triple("CARTESIAN_POINT", origin)
        return self.add(f"AXIS2_PLACEMENT_3D('',{point},{self.triple('DIRECTION', z)},{self.triple('DIRECTION', x)})")


def step_box(size: tuple[float, float, float], unit: str, places: Sequence[float] = ()) -> str:
    """A box from the origin to `size`, called hull; with `places` an assembly of it, moved so far along x. Source:
    ISO 10303-214, by the entities' own names."""
    text = StepText()
    context = text.add("APPLICATION_CONTEXT('automotive_design')")
    text.add(f"APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,{context})")
    mechanical = text.add(f"PRODUCT_CONTEXT('',{context},'mechanical')")
    product = text.add(f"PRODUCT('hull','hull','',({mechanical}))")
    form = text.add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
    design = text.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{context},'design')")
    definition = text.add(f"PRODUCT_DEFINITION('design','',{form},{design})")
    shape = text.add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
    units = [f"(LENGTH_UNIT() NAMED_UNIT(*) {unit})", "(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))"]
    named = ",".join(text.add(each) for each in [*units, "(NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT())"])
    space = text.add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT(({named})) REPRESENTATION_CONTEXT('',''))"
    )
    at = {corner: np.multiply(corner, size) for corner in itertools.product((0, 1), repeat=3)}
    vertices = {each: text.add(f"VERTEX_POINT('',{text.triple('CARTESIAN_POINT', at[each])})") for each in at}
    edges: dict[tuple[object, object], str] = {}
    faces = []
    for axis, side in itertools.product(range(3), (0, 1)):
        across, up = np.roll(np.eye(3), axis + 1, axis=1)[0], np.roll(np.eye(3), axis + 2, axis=1)[0]
        normal = np.roll(np.eye(3), axis, axis=1)[0]
        loop = [tuple(int(x) for x in side * normal + a * across + b * up) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        loop = loop if side else loop[::-1]
        oriented = []
        for start, end in zip(loop, [*loop[1:], loop[0]], strict=True):
            if (end, start) not in edges:
                way = np.subtract(end, start)
                vector = text.add(f"VECTOR('',{text.triple('DIRECTION', way)},1.)")
                line = text.add(f"LINE('',{text.triple('CARTESIAN_POINT', at[start])},{vector})")
                edges[start, end] = text.add(f"EDGE_CURVE('',{vertices[start]},{vertices[end]},{line},.T.)")
            edge, same = (edges[end, start], ".F.") if (end, start) in edges else (edges[start, end], ".T.")
            oriented.append(text.add(f"ORIENTED_EDGE('',*,*,{edge},{same})"))
        around = text.add(f"EDGE_LOOP('',({','.join(oriented)}))")
        bound = text.add(f"FACE_OUTER_BOUND('',{around},.T.)")
        plane = text.add(f"PLANE('',{text.axes(at[loop[0]], normal if side else -normal, across)})")
        faces.append(text.add(f"ADVANCED_FACE('',({bound}),{plane},.T.)"))
    shell = text.add(f"CLOSED_SHELL('',({','.join(faces)}))")
    solid = text.add(f"MANIFOLD_SOLID_BREP('hull',{shell})")
    placed = text.axes((0, 0, 0), (0, 0, 1), (1, 0, 0))
    whole = text.add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',({placed},{solid}),{space})")
    text.add(f"SHAPE_DEFINITION_REPRESENTATION({shape},{whole})")
    if places:
        craft = text.add(f"PRODUCT('craft','craft','',({mechanical}))")
        craft = text.add(f"PRODUCT_DEFINITION_FORMATION('','',{craft})")
        craft = text.add(f"PRODUCT_DEFINITION('design','',{craft},{design})")
        at_places = [text.axes((x, 0, 0), (0, 0, 1), (1, 0, 0)) for x in places]
        joined = text.add(f"SHAPE_REPRESENTATION('',({','.join(at_places)}),{space})")
        shape = text.add(f"PRODUCT_DEFINITION_SHAPE('','',{craft})")
        text.add(f"SHAPE_DEFINITION_REPRESENTATION({shape},{joined})")
        for number, place in enumerate(at_places, 1):
            used = text.add(f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('NAUO{number}','','',{craft},{definition},$)")
            used = text.add(f"PRODUCT_DEFINITION_SHAPE('','',{used})")
            moved = text.add(f"ITEM_DEFINED_TRANSFORMATION('','',{placed},{place})")
            moved = text.add(
                f"(REPRESENTATION_RELATIONSHIP('','',{whole},{joined}) "
                f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved}) SHAPE_REPRESENTATION_RELATIONSHIP())"
            )
            text.add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({moved},{used})")
    head = "FILE_DESCRIPTION((''),'2;1');FILE_NAME('','',(''),(''),'','','');FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));"
    return "\n".join(["ISO-10303-21;HEADER;", head, "ENDSEC;DATA;", *text, "ENDSEC;END-ISO-10303-21;"])


@pytest.mark.parametrize(("unit", "metre"), [(MILLIMETRE, 1000.0), (METRE, 1.0)])
def test_a_box_is_in_metres_by_the_unit_of_its_file(tmp_path: Path, unit: str, metre: float) -> None:
    pytest.importorskip("cascadio")
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    (tmp_path / "box.step").write_text(step_box((1 * metre, 2 * metre, 3 * metre), unit))
    report = author_stage(
        poses=tmp_path / "poses.json", out=tmp_path / "stage", target=tmp_path / "box.step", camera="speedplus"
    )
    reader = StageReader(report.root)
    target = reader.scene(reader.frames[0]).bodies[0].target
    np.testing.assert_allclose(target.mesh.box, [[0, 0, 0], [1, 2, 3]], atol=1e-6)
    assert [part.name for part in target.parts] == ["hull"]


def test_an_assembly_has_its_products_names_and_a_plain_paint(tmp_path: Path) -> None:
    """Open CASCADE names each use NAUO1, NAUO2 and so on; glTF is metal where no colour is said."""
    pytest.importorskip("cascadio")
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    (tmp_path / "craft.step").write_text(step_box((1, 2, 3), METRE, places=(0, 5)))
    report = author_stage(
        poses=tmp_path / "poses.json", out=tmp_path / "stage", target=tmp_path / "craft.step", camera="speedplus"
    )
    reader = StageReader(report.root)
    target = reader.scene(reader.frames[0]).bodies[0].target
    np.testing.assert_allclose(target.mesh.box, [[0, 0, 0], [6, 2, 3]], atol=1e-6)
    assert [part.name for part in target.parts] == ["hull", "hull_1"]
    assert {material.metallic for material in target.materials} == {0}
    assert "2 of 2 parts have no colour in the file: they are of a plain paint" in report.notes


def test_a_damaged_file_is_refused_in_a_sentence(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    (tmp_path / "cut.stp").write_text(step_box((1, 2, 3), METRE)[:3000])
    with pytest.raises(SpinError, match=r"cut\.stp: cannot be read as STEP"):
        author_stage(poses=tmp_path / "poses.json", out=tmp_path / "s", target=tmp_path / "cut.stp", camera="speedplus")
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize("name", ["craft.3ds", "craft.3mf", "craft.x3d"])
def test_other_formats_are_refused_with_what_converts_them(name: str) -> None:
    with pytest.raises(InputError, match=rf"{name}: is not a model file; .*Blender .*: assimp export {name} craft.glb"):
        model_file(name)


def test_without_the_extra_one_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cascadio", None)
    with pytest.raises(
        MissingPackageError, match=r"box\.step: a model in STEP needs cascadio.*pip install 'cascadio>=0.1.1'"
    ):
        convert_step(
            ModelToConvert(source=str(tmp_path / "box.step"), to=str(tmp_path / "box.glb"), root=str(tmp_path))
        )
