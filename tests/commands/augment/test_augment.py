"""`spin-usd augment` without a stage."""

import json

from spin_usd.scene.derived.sunlight import sunlight
from spin_usd.stage.augment.parameters import PARAMETERS, parameter_named
from spin_usd.stage.read.stage_reader import StageReader


def test_every_parameter_is_listed_with_its_units_and_range(spin_usd) -> None:
    rows = {row["name"]: row for row in json.loads(spin_usd("augment", "--list", "--json").stdout)}
    assert set(PARAMETERS) <= set(rows)
    assert {name for name in set(rows) - set(PARAMETERS) if not name.startswith(("material.", "/"))} == {"background"}
    assert rows["exposure.stops"]["units"] == ["stops"]
    assert rows["material.NAME.ior"]["takes"] == str(parameter_named("material.NAME.ior").limits)
    assert not rows["lens.fx"]["per_frame"]
    lines = spin_usd("augment", "--list").stdout.splitlines()
    assert lines[::2] == [line for line in lines if not line.startswith(" ")]
    assert "exposure.stops: numbers from -60 to 60 stops" in lines


def test_without_a_stage_it_says_what_it_needs(spin_usd) -> None:
    assert "needs a stage and --spec" in spin_usd("augment", code=2).stderr


def test_no_appearance_of_isda_lies_in_the_shadow_of_its_earth(tmp_path, spin_usd) -> None:
    """One of the three has no planet, whose constraint binds the others."""
    author = ("author", "--sample", "range=5..10 inside=1 count=30", "--seed", "3", "--target", "tango")
    spin_usd(*author, "--camera", "speedplus", "--augment", "isda", "--out", tmp_path / "stage")
    planets = []
    for number in (1, 2, 3):
        reader = StageReader(tmp_path / "stage" / "dataset.usda", variant=f"isda_{number}")
        scenes = [reader.scene(frame) for frame in reader.frames]
        planets.append(len(scenes[0].environment.planets))
        assert all(sunlight(scene.lights, scene.bodies[0].T_cam_body).obscured == 0 for scene in scenes)
    assert sorted(planets) == [0, 1, 1]
