"""The parameters that a specification of augmentations can sample, as a table for people and programs."""

from typing import Any

from spin_usd.scene.environment import BACKGROUND
from spin_usd.stage.augment.parameter import ATTITUDE, DIRECTION, NUMBER, UNITS, Parameter
from spin_usd.stage.augment.parameters import FIELDS, NUMBERED, PARAMETERS, parameter_named

TAKES = {DIRECTION: "x, y, z", ATTITUDE: "w, x, y, z"}
BACKGROUND_IS = "The environment, by its name, that replaces the stage's own."
INPUT_IS = (
    "An input of the material NAME; of all materials alike where NAME is *, of each for itself where it is each. Its "
    "factor is NAME.{}.factor."
)
ATTRIBUTE_IS = "Any attribute of the stage, by its path, with the attribute's own values."


def parameter_list() -> list[dict[str, Any]]:
    """Return an entry for each parameter: its name, its units (none for plain numbers), its range in the first of them,
    whether it can differ between pictures, and its description."""
    materials = (parameter_named(f"material.NAME.{field}") for field in FIELDS)
    return [
        *(_entry(parameter, parameter.description) for parameter in (*PARAMETERS.values(), *NUMBERED.values())),
        *(_entry(each, INPUT_IS.format(each.name.rpartition(".")[2])) for each in materials),
        _row(BACKGROUND, "a name", BACKGROUND_IS, per_frame=False),
        _row("/PRIM/PATH.ATTRIBUTE", "any", ATTRIBUTE_IS),
    ]


def _entry(parameter: Parameter, description: str) -> dict[str, Any]:
    takes = str(parameter.limits) if parameter.kind == NUMBER else TAKES.get(parameter.kind, "true or false")
    row = _row(parameter.name, takes, description, per_frame=parameter.changes)
    return row | {"units": list(UNITS.get(parameter.unit, ()))}


def _row(name: str, takes: str, description: str, *, per_frame: bool = True) -> dict[str, Any]:
    return {"name": name, "units": [], "takes": takes, "per_frame": per_frame, "description": description}
