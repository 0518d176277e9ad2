"""The order of prims by which ids, faces and lights are numbered: that in which the layers that define them list them.

USD's own order is of all opinions: an override of a variant, or `reorder` in a stronger layer, may put any child first.
Numbers must not change by what only overrides a prim. So here a child stands where the weakest layer that defines it
lists it, before those that a variant alone brings.
"""

from collections.abc import Iterable, Iterator

from pxr import Pcp, Sdf, Usd

from spin_usd.stage.usd.visibility import PROXIES


def ordered_children(prim: Usd.Prim) -> list[Usd.Prim]:
    """List the children of `prim` that are active, loaded, defined and not abstract, instances' included."""
    children: list[Usd.Prim] = prim.GetFilteredChildren(PROXIES)
    if len(children) < 2:
        return children
    specs = [*_specs(prim.GetPrimIndex().rootNode)]
    if len(specs) == 1 and not specs[0][0].nameChildrenOrder:
        return children
    places = _places([spec for spec, in_variant in specs if not in_variant])
    places = _places([spec for spec, in_variant in specs if in_variant], after=places)
    return sorted(children, key=lambda child: places.get(child.GetName(), len(places)))


def in_order(prims: Iterable[Usd.Prim]) -> list[Usd.Prim]:
    """Sort prims of one stage as a walk over `ordered_children` would meet them."""
    found = list(prims)
    if len(found) < 2:
        return found
    names: dict[Sdf.Path, dict[str, int]] = {}

    def place(prim: Usd.Prim) -> tuple[int, ...]:
        parent = prim.GetParent()
        if not parent:
            return ()
        path = parent.GetPath()
        if path not in names:
            names[path] = {child.GetName(): number for number, child in enumerate(ordered_children(parent))}
        return *place(parent), names[path].get(prim.GetName(), len(names[path]))

    return sorted(found, key=place)


def _specs(node: Pcp.NodeRef, in_variant: bool = False) -> Iterator[tuple[Sdf.PrimSpec, bool]]:
    """Yield the prim specs of `node` and the nodes below it, the weakest first, each with whether a variant brings
    it."""
    in_variant = in_variant or node.arcType == Pcp.ArcTypeVariant
    for child in reversed(node.children):
        yield from _specs(child, in_variant)
    for layer in reversed(node.layerStack.layers):
        if spec := layer.GetPrimAtPath(node.path):
            yield spec, in_variant


def _places(specs: list[Sdf.PrimSpec], after: dict[str, int] | None = None) -> dict[str, int]:
    """Number the names of the children of `specs`, the weakest first: those that they define, then those that they
    override. Those in `after` keep their numbers."""
    places = dict(after or {})
    for overrides in (False, True):
        for spec in specs:
            for name, child in spec.nameChildren.items():
                if (child.specifier == Sdf.SpecifierOver) == overrides:
                    places.setdefault(name, len(places))
    return places
