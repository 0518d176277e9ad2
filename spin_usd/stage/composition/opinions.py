"""The origin of an opinion of a composed stage: its layer, and the variants on the way to it."""

from collections.abc import Iterator
from pathlib import Path

from pxr import Pcp, Sdf, Usd


def origin(prim: Usd.Prim, spec: Sdf.Spec) -> str:
    """Name the layer of `spec`, an opinion on `prim` or a property of it, relative to the stage's folder, and all
    variants on the way to it, outermost first: "layers/rich.usda {augmentation=isda_1, camera=rich}"."""
    node = _node(prim.GetPrimIndex().rootNode, spec.layer, spec.path.GetPrimOrPrimVariantSelectionPath())
    paths = [spec.path]
    while node:
        paths.append(node.path)
        node = node.parent
    selections = [f"{name}={variant}" for path in reversed(paths) for name, variant in _selections(path)]
    file = _layer_name(spec.layer, prim.GetStage())
    return f"{file} {{{', '.join(dict.fromkeys(selections))}}}" if selections else file


def strongest(stack: list[Sdf.PropertySpec]) -> Sdf.PropertySpec | None:
    """Return the first of a property's specs, strongest first, that has an opinion on its value."""
    return next((spec for spec in stack if has_opinion(spec)), None)


def _layer_name(layer: Sdf.Layer, stage: Usd.Stage) -> str:
    """Return the layer's file, relative to the stage's folder."""
    folder, file = Path(stage.GetRootLayer().realPath).parent, Path(layer.realPath)
    return file.relative_to(folder).as_posix() if file.is_relative_to(folder) else str(layer.identifier)


def has_opinion(spec: Sdf.PropertySpec) -> bool:
    """Return whether the spec authors a value, targets or connections, or an empty list of them."""
    if isinstance(spec, Sdf.RelationshipSpec):
        return bool(spec.targetPathList.isExplicit or spec.targetPathList.GetAddedOrExplicitItems())
    return bool(
        spec.HasDefaultValue()
        or spec.layer.GetNumTimeSamplesForPath(spec.path)
        or spec.HasInfo("spline")
        or spec.connectionPathList.isExplicit
        or spec.connectionPathList.GetAddedOrExplicitItems()
    )


def _node(node: Pcp.NodeRef, layer: Sdf.Layer, path: Sdf.Path) -> Pcp.NodeRef | None:
    """Find the node at or below `node` that contributes the opinions of `layer` at `path`."""
    if node.path == path and layer in node.layerStack.layers:
        return node
    below = (_node(child, layer, path) for child in node.children)
    return next((found for found in below if found), None)


def _selections(path: Sdf.Path) -> Iterator[tuple[str, str]]:
    for prefix in path.GetPrefixes():
        if prefix.IsPrimVariantSelectionPath():
            name, variant = prefix.GetVariantSelection()
            yield name, variant
