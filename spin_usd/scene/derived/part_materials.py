"""Which materials the parts of a target have."""

from collections.abc import Mapping

import numpy as np

from spin_usd.scene.target import Target


def part_materials(target: Target) -> Mapping[int, tuple[str, ...]]:
    """Return the names of the materials of each part that has any, by its id; a displayColor has no name."""
    mesh = target.mesh
    pairs = _pairs(mesh.face_part, mesh.face_material)
    for each in mesh.instances:
        for column, material in _pairs(each.shape.face_part, each.shape.face_material):
            pairs |= {(int(part), material) for part in np.unique(each.parts[:, column])}
    found: dict[int, tuple[str, ...]] = {}
    for part, material in sorted(pairs):
        path = target.materials[material].path
        if path and "." not in path:
            found[part] = (*found.get(part, ()), path.rpartition("/")[2])
    return found


def _pairs(*columns: np.ndarray) -> set[tuple[int, int]]:
    """Return each pair that stands in the two columns (F,) side by side."""
    return {(first, second) for first, second in np.unique(np.stack(columns, 1), axis=0).tolist()}
