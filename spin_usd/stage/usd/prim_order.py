"""The order of prims by which ids, faces and lights are numbered: USD's own, except for variants and `reorder`.

USD lists children in the order of the weakest layer that names them, even as overrides, and variants are weaker than
the layers that contain them: so a variant may put another child first, as may `reorder` in a stronger layer. Here
children named by variants come last, and `reorder` is ignored: neither changes a number.
"""

from collections.abc import Iterable, Iterator
from functools import reduce

from pxr import Pcp, Sdf, Usd

from spin_usd.stage.usd.visibility import PROXIES

UNDEFINED = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract)


def ordered_children(prim: Usd.Prim) -> list[Usd.Prim]:
    """List the children of `prim` that are active, loaded, defined and not abstract, instances' included; within an
    over, which only an instancer shows, undefined ones too."""
    children: list[Usd.Prim] = prim.GetFilteredChildren(PROXIES if prim.IsDefined() else UNDEFINED)
    if len(children) < 2:
        return children
    specs = [*_specs(prim.GetPrimIndex().rootNode)]
    if len(specs) == 1 and not specs[0][0].nameChildrenOrder:
        return children
    places = _places(spec for spec, _ in sorted(specs, key=lambda each: each[1]))
    return sorted(children, key=lambda child: places.get(child.GetName(), len(places)))


def in_order(prims: Iterable[Usd.Prim]) -> list[Usd.Prim]:
    """Sort prims of one stage as a walk over `ordered_children` would meet them."""
    found = list(prims)
    if len(found) < 2:
        return found
    top = reduce(Sdf.Path.GetCommonPrefix, (prim.GetPath() for prim in found))  # prims above it do not order them
    names: dict[Sdf.Path, dict[str, int]] = {}

    def place(prim: Usd.Prim) -> tuple[int, ...]:
        if prim.GetPath() == top:
            return ()
        parent = prim.GetParent()
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


def _places(specs: Iterable[Sdf.PrimSpec]) -> dict[str, int]:
    """Number the names of the children of `specs` in the order in which they come first."""
    names = dict.fromkeys(child.name for spec in specs for child in spec.nameChildren.values())
    return {name: place for place, name in enumerate(names)}
