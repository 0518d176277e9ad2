"""`spin-usd augment` without a stage."""

import json

from spin_usd.stage.augment.parameters import PARAMETERS, parameter_named


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
