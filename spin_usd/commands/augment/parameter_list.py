"""The parameters that a specification of augmentations can sample, as a table for people and programs."""

from spin_usd.commands.author.reports import ParameterRow
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


def parameter_list() -> list[ParameterRow]:
    """Return a row for each parameter."""
    materials = (parameter_named(f"material.NAME.{field}") for field in FIELDS)
    path = "/PRIM/PATH.ATTRIBUTE"
    return [
        *(_row(parameter, parameter.description) for parameter in (*PARAMETERS.values(), *NUMBERED.values())),
        *(_row(each, INPUT_IS.format(each.name.rpartition(".")[2])) for each in materials),
        ParameterRow(name=BACKGROUND, takes="a name", description=BACKGROUND_IS, per_frame=False),
        ParameterRow(name=path, takes="any", description=ATTRIBUTE_IS, per_frame=True),
    ]


def _row(parameter: Parameter, description: str) -> ParameterRow:
    return ParameterRow(
        name=parameter.name,
        units=tuple(UNITS.get(parameter.unit, ())),
        takes=str(parameter.limits) if parameter.kind == NUMBER else TAKES.get(parameter.kind, "true or false"),
        per_frame=parameter.changes,
        description=description,
    )
