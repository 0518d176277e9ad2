"""Rule: every spin:* property is defined by the schema; others have no effect."""

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
            if name.startswith(NAMESPACE) and name not in _defined():
                near = get_close_matches(name, sorted(_defined()), n=1)
                hint = f": is {near[0]} meant?" if near else "; remove it"
                message = f"no schema defines {name}, so it does nothing{hint}"
                yield Finding(code="property-unknown", where=str(prim.GetPath()), message=message, severity=WARNING)


@cache
def _defined() -> frozenset[str]:
    registry = Usd.SchemaRegistry()
    definitions = [registry.FindAppliedAPIPrimDefinition(name) for name in schema.APIS]
    return frozenset(name for definition in definitions for name in definition.GetPropertyNames())
