"""Rules on the schema's own properties: one that it does not define is read by nothing."""

from collections.abc import Iterator
from difflib import get_close_matches
from functools import cache

from pxr import Usd

from spin_usd.scene.finding import WARNING, Finding
from spin_usd.stage.usd import schema

NAMESPACE = "spin:"


def property_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Every authored spin:* property is one that the schema defines."""
    for prim in stage.Traverse():
        for name in prim.GetAuthoredPropertyNames():
            if name.startswith(NAMESPACE) and name not in _known():
                near = get_close_matches(name, sorted(_known()), n=1)
                hint = f": is {near[0]} meant?" if near else "; remove it"
                message = f"no schema defines {name}, so it does nothing{hint}"
                yield Finding(code="property-unknown", where=str(prim.GetPath()), message=message, severity=WARNING)


@cache
def _known() -> frozenset[str]:
    registry = Usd.SchemaRegistry()
    definitions = [registry.FindAppliedAPIPrimDefinition(name) for name in schema.APIS]
    return frozenset(name for definition in definitions for name in definition.GetPropertyNames())
