"""The opinions on a composed prim, strongest first, and the variant selections that contribute them.

Opinions of a layer that a variant references count as the variant's: they are as strong.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from pxr import Pcp, Sdf, Usd

from spin_usd.errors import StageError


@dataclass(frozen=True, kw_only=True)
class VariantSelection:
    """The `variant` of the set `name` on the prim at `owner`, as composed."""

    owner: Sdf.Path
    name: str
    variant: str

    def __str__(self) -> str:
        return f"{self.name}={self.variant}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Opinion:
    """One layer's spec of a prim. through: the selections that contribute it, outermost first."""

    spec: Sdf.PrimSpec
    through: tuple[VariantSelection, ...]

    @cached_property
    def properties(self) -> dict[str, Sdf.PropertySpec]:
        """Its property specs, by name. Raises StageError where a damaged layer lists one that it does not hold."""
        specs = list(self.spec.properties)
        if not all(specs):
            where = f"{self.spec.layer.identifier} {self.spec.path}"
            raise StageError("lists a property that the layer does not hold", where=where, do="write the layer again")
        return {spec.name: spec for spec in specs}

    @cached_property
    def selections(self) -> dict[str, str]:
        """Its variant selections, by variant set."""
        return dict(self.spec.variantSelections.items())


def opinions(prim: Usd.Prim) -> list[Opinion]:
    """List all opinions on `prim`, strongest first, without the session layer, which is used for trials."""
    session = prim.GetStage().GetSessionLayer()
    return list(_of_node(prim.GetPrimIndex().rootNode, prim.GetPath(), (), session))


def _of_node(
    node: Pcp.NodeRef, composed: Sdf.Path, above: tuple[VariantSelection, ...], session: Sdf.Layer
) -> Iterator[Opinion]:
    through = above + tuple(each for each in _selections(node.path, composed) if each not in above)
    if node.hasSpecs:
        for layer in node.layerStack.layers:
            spec = layer.GetPrimAtPath(node.path) if layer != session else None
            if spec:
                yield Opinion(spec=spec, through=through)
    for child in node.children:  # in the order of their strength
        yield from _of_node(child, composed, through, session)


def _selections(path: Sdf.Path, composed: Sdf.Path) -> Iterator[VariantSelection]:
    """Yield the selections on the way to `path`, for the prim that is at `composed` on the stage."""
    for prefix in path.GetPrefixes():
        if prefix.IsPrimVariantSelectionPath():
            below = path.StripAllVariantSelections().pathElementCount
            below -= prefix.StripAllVariantSelections().pathElementCount
            owner = composed
            for _ in range(below):
                owner = owner.GetParentPath()
            name, variant = prefix.GetVariantSelection()
            yield VariantSelection(owner=owner, name=name, variant=variant)
