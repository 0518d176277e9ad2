"""The materials of parts, of a mesh with instances and of the same made out."""

from dataclasses import replace

from spin_usd.scene.derived.part_materials import part_materials
from spin_usd.scene.material import Material
from tests.cases.instanced import made_out, placed

FOIL, SHOWN = Material(path="/T/mtl/gold_foil", metallic=1.0), Material(path="/T/ball.primvars:displayColor")


def test_parts_of_instances_have_the_materials_that_their_faces_have() -> None:
    target = placed(materials=(FOIL, Material(path="/T/mtl/glass")), count=2)
    found = part_materials(target)
    assert set(found) == {part.id for part in target.parts}
    assert set(found.values()) == {("gold_foil", "glass"), ("gold_foil",)}
    assert part_materials(replace(target, mesh=made_out(target.mesh))) == found


def test_a_display_colour_and_nothing_at_all_have_no_name() -> None:
    target = placed(materials=(SHOWN, Material(path="")), count=2)
    assert part_materials(target) == {}
