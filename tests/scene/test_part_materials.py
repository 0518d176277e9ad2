"""The materials of parts, of a mesh with instances and of the same made out."""

from dataclasses import replace

from spin_usd.scene.material import Material
from tests.cases.instanced import made_out, placed

FOIL, SHOWN = Material(path="/T/mtl/gold_foil", metallic=1.0), Material(path="/T/ball.primvars:displayColor")


def test_parts_of_instances_have_the_materials_that_their_faces_have() -> None:
    target = placed(materials=(FOIL, Material(path="/T/mtl/glass")), count=2)
    found = target.part_materials
    assert set(found) == {part.id for part in target.parts}
    assert set(found.values()) == {("gold_foil", "glass"), ("gold_foil",)}
    assert replace(target, mesh=made_out(target.mesh)).part_materials == found


def test_a_display_colour_and_nothing_at_all_have_no_name() -> None:
    target = placed(materials=(SHOWN, Material(path="")), count=2)
    assert target.part_materials == {}
