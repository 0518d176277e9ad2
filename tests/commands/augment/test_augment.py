"""`spin-usd augment` without a stage."""

import json
import shutil

import numpy as np
import pytest

from spin_usd.scene.derived.sunlight import sunlight
from spin_usd.stage.augment.parameters import PARAMETERS, parameter_named
from spin_usd.stage.read.stage_reader import StageReader


def test_every_parameter_is_listed_with_its_units_and_range(spin_usd) -> None:
    rows = {row["name"]: row for row in json.loads(spin_usd("augment", "--list", "--json").stdout)}
    assert set(PARAMETERS) <= set(rows)
    beside = {name for name in set(rows) - set(PARAMETERS) if not name.startswith(("material.", "part.", "/"))}
    assert beside == {"background", "sun.N.direction", "sun.N.factor"}
    assert rows["exposure.stops"]["units"] == ["stops"]
    assert rows["material.NAME.ior"]["takes"] == str(parameter_named("material.NAME.ior").limits)
    assert not rows["lens.fx"]["per_frame"]
    lines = spin_usd("augment", "--list").stdout.splitlines()
    assert lines[::2] == [line for line in lines if not line.startswith(" ")]
    assert "exposure.stops: numbers from -60 to 60 stops" in lines


def test_without_a_stage_it_says_what_it_needs(spin_usd) -> None:
    assert "needs a stage and --spec" in spin_usd("augment", code=2).stderr


def test_several_suns_all_keep_the_constraints(small_stage, spin_usd, tmp_path) -> None:
    spec, stage = tmp_path / "suns.toml", shutil.copytree(small_stage.parent, tmp_path / "stage")
    suns = "".join(
        f'"sun.{name}direction" = {{ distribution = "directions", per = "frame" }}\n' for name in ("", "2.", "3.")
    )
    factor = '"sun.factor" = { distribution = "uniform", low = 0.5, high = 2, per = "frame" }'
    spec.write_text(f"""schema = "augment-1"
[[augmentation]]
name = "suns"
[augmentation.sample]
{suns}{factor}
[augmentation.constraints]
target_lit_deg = 40
sun_from_boresight_deg = 150
""")
    spin_usd("augment", stage, "--spec", spec)
    reader = StageReader(stage / "dataset.usda", variant="suns")
    for frame in reader.frames:
        scene = reader.scene(frame)
        towards = -np.array([light.direction_cam for light in scene.lights])
        assert len({light.irradiance for light in scene.lights}) == 1
        assert len(np.unique(towards.round(6), axis=0)) == 3
        at = scene.bodies[0].T_cam_body.translation
        assert np.degrees(np.arccos(towards @ (-at / np.linalg.norm(at)))).max() < 40.5  # of the middle of its bound
        assert np.degrees(np.arccos(towards[:, 2])).min() > 150
    assert len({frame.name for frame in reader.frames}) == 8


def test_earths_of_isda_differ_and_none_shades_the_target(tmp_path, spin_usd) -> None:
    """One of the three appearances has no planet, whose parameters and constraint bind the others."""
    author = ("author", "--sample", "range=5..10 inside=1 count=30", "--seed", "3", "--target", "tango")
    spin_usd(*author, "--camera", "speedplus", "--augment", "isda", "--out", tmp_path / "stage")
    planets = []
    for number in (1, 2, 3):
        reader = StageReader(tmp_path / "stage" / "dataset.usda", variant=f"isda_{number}")
        scenes = [reader.scene(frame) for frame in reader.frames]
        planets.append(len(scenes[0].environment.planets))
        earths = {planet.T_cam_planet.rotation.tobytes() for scene in scenes for planet in scene.environment.planets}
        assert len(earths) == 30 * planets[-1]
        assert all(sunlight(scene.lights, scene.bodies[0].T_cam_body).obscured == 0 for scene in scenes)
    assert sorted(planets) == [0, 1, 1]


TOGETHER = """schema = "augment-1"
seed = 0
[[augmentation]]
name = "a"
[augmentation.sample]
"sun.direction" = { distribution = "choice", values = [[0, 0, -1], [0.1, 0, -1], [0.2, 0, -1], [0, 0, 1]], per = "frame" }
"sun.irradiance" = { distribution = "choice", values = [1, 2, 3, 4], unit = "W/m2", per = "frame", together = "sun.direction" }
[augmentation.constraints]
sun_from_boresight_deg = 90
"""  # noqa: E501


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("[1, 2, 3, 4]", "[1, 2, 3]", "there are 3 values, and 4 of it"),
        ('together = "sun.direction"', 'together = "sun.directon"', "it is not sampled here"),
        ('together = "sun.direction"', 'together = "sun.irradiance"', "that is the parameter itself"),
        ('per = "frame", together', "together", "one is sampled once, the other per picture"),
        ("together =", "weights = [1, 1, 1, 2], together =", "their weights differ"),
        ("[[0, 0, -1]", "[[0, 0, -1], [0, 0, -1]", "there are 4 values, and 5 of it"),
    ],
)
def test_values_that_cannot_be_chosen_together_are_refused(small_stage, spin_usd, tmp_path, old, new, reason) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(TOGETHER.replace(old, new))
    said = spin_usd("augment", small_stage, "--spec", spec, "--out", small_stage.parent / "never.usda", code=2).stderr
    assert "sun.irradiance: cannot be chosen together with sun." in said
    assert reason in said


@pytest.mark.parametrize("follower", ["sun.irradiance", "sun.direction"])
def test_values_are_chosen_together_also_where_a_constraint_refuses_some(small_stage, spin_usd, tmp_path, follower):
    """The constraint bears on the direction, whichever of both follows the other."""
    spec, text = tmp_path / "spec.toml", TOGETHER
    if follower == "sun.direction":
        text = text.replace(', together = "sun.direction"', "")
        text = text.replace('"frame" }', '"frame", together = "sun.irradiance" }', 1)
    spec.write_text(text)
    spin_usd("augment", small_stage, "--spec", spec, "--out", small_stage.parent / f"{follower}.usda")
    reader = StageReader(small_stage.parent / f"{follower}.usda", variant="a")
    found = set()
    for frame in reader.frames:
        (sun,) = (light for light in reader.scene(frame).lights if light.path.endswith("Sun"))
        found.add((round(-sun.direction_cam[0] / sun.direction_cam[2] * 10), round(sun.irradiance[0])))
    assert len(found) > 1
    assert {(abs(across), strength) for across, strength in found} <= {(0, 1), (1, 2), (2, 3)}
