"""Materials by the names of parts, as people and tools give them, and by colours."""

import pytest

from spin_usd.basics.resources import bundled_names
from spin_usd.scene.derived.recognised_material import COLORS, UNKNOWN, recognised, words_of
from spin_usd.stage.author.material_library import vocabulary

NAMES = {
    "SolarPanel_L": "solar_cell",
    "solararray2": "solar_cell",
    "Solar_Panel_Back": "solar_panel_substrate",
    "Panneau_solaire.001": "solar_cell",
    "Solarzelle": "solar_cell",
    "SA_left": "solar_cell",
    "gold_foil_1": "gold_foil",
    "Foil_Silver": "silver_foil",
    "RBSP-Black-foil-sm": "black_foil",
    "MLI": "gold_foil",
    "HGA_dish": "white_paint",
    "Antennen": "white_paint",
    "ApogeeEngineNozzle": "thruster_nozzle",
    "Düse": "thruster_nozzle",
    "tuyère": "thruster_nozzle",
    "StarTracker1": "star_tracker_baffle",
    "patch antenna": "patch_antenna",
    "Edelstahl": "stainless_steel",
    "CFRP_boom": "carbon_fibre",
    "Radiator_port": "white_paint",
    "main_bus": "gold_foil",
    "BusBar": "silver",
    "Lenses": "lens",
    "AntennaGold": "gold_foil",
    "Main_Dish-black": "black_paint",
    "Strut Gold": "gold_foil",
    "black_krinkle": "black_foil",
    "TESglass": "glass",
    "MLI_darkbronze": "gold_foil",
    "Grey-nofoil-fl": "aluminium",
    "Solar Shield Keel": "aluminium",
    "NGTDRSS-SolarPanelEdges": "solar_panel_substrate",
    "lens_covers_front": "white_paint",
}
NOTHING = ("Material.001", "default", "Cube_3", "panel", "cellphone", "busy", "satellite", "Sanded", "titanic")


@pytest.mark.parametrize("name", NAMES)
def test_a_name_tells_the_material(name: str) -> None:
    assert recognised([name], [], None, vocabulary()).material == NAMES[name]


@pytest.mark.parametrize("name", NOTHING)
def test_a_name_that_says_nothing_tells_nothing(name: str) -> None:
    found = recognised([name], [], None, vocabulary())
    assert (found.material, found.color, found.note) == ("white_paint", None, UNKNOWN)


def test_a_material_counts_before_a_part_and_a_part_before_its_group() -> None:
    known = vocabulary()
    assert recognised(["antenna"], ["MLI"], None, known).material == "gold_foil"
    assert recognised(["solar_array", "hinge", "bolt"], [], None, known).material == "stainless_steel"
    assert recognised(["solar_array", "solar_array/plate", "plate"], [], None, known).material == "solar_cell"
    assert recognised(["solar_array"], ["blue"], None, known).material == "solar_cell"


@pytest.mark.parametrize(
    ("color", "material"),
    [
        ((0.8, 0.5, 0.1), "gold_foil"),
        ((0.01, 0.03, 0.2), "solar_cell"),
        ((0.01, 0.01, 0.01), "black_paint"),
        ((0.9, 0.9, 0.88), "white_paint"),
        ((0.3, 0.3, 0.32), "aluminium"),
    ],
)
def test_a_colour_tells_where_no_name_does(color, material: str) -> None:
    assert recognised(["Cube"], [], color, vocabulary()).material == material


def test_parts_of_many_materials_have_the_one_of_their_colour() -> None:
    known = vocabulary()
    assert recognised(["rail"], [], (0.78, 0.6, 0.22), known).material == "gold_foil"
    assert recognised(["bus"], [], (0.3, 0.3, 0.3), known).material == "gold_foil"
    assert recognised(["bus"], [], (0.01, 0.03, 0.2), known).material == "solar_cell"


def test_a_foil_that_does_not_say_its_colour_has_that_of_the_model() -> None:
    known = vocabulary()
    assert recognised(["foil_antenna"], [], (0.64, 0.64, 0.64), known).material == "silver_foil"
    assert recognised(["MLI"], [], (0.01, 0.01, 0.01), known).material == "black_foil"
    assert recognised(["MLI"], [], (0.8, 0.5, 0.1), known).material == "gold_foil"
    assert recognised(["GoldFoil"], [], (0.8, 0.8, 0.8), known).material == "gold_foil"
    assert recognised(["nozzle"], [], (0.01, 0.01, 0.01), known).material == "thruster_nozzle"


def test_any_other_muted_colour_is_a_paint() -> None:
    found = recognised(["Cube"], [], (0.3, 0.4, 0.25), vocabulary())
    assert (found.material, found.color) == ("white_paint", (0.3, 0.4, 0.25))


@pytest.mark.parametrize("color", [(0.02, 0.7, 0.75), (0.7, 0.05, 0.05), (0.1, 0.6, 0.1)])
def test_a_strong_colour_of_no_material_tells_nothing(color: tuple[float, float, float]) -> None:
    found = recognised(["Cube"], [], color, vocabulary())
    assert (found.material, found.color, found.note) == ("white_paint", None, UNKNOWN)
    assert recognised(["bus"], [], color, vocabulary()).material == "gold_foil"


def test_words_of_names() -> None:
    assert words_of("BusPanel_2") == ("bus", "panel")
    assert words_of("HGA2dish-Étage") == ("hga", "dish", "etage")


def test_every_word_is_of_a_material_and_plain() -> None:
    for words in vars(vocabulary()).values():
        assert set(words.values()) <= set(bundled_names("material"))
        assert all(" ".join(words_of(entry)) == entry.replace("*", "") for entry in words)
    assert {rule.material for rule in COLORS} <= set(bundled_names("material"))
