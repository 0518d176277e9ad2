"""Rule on a target's shape: visible coincident faces.

Of two, labels only show the one with the lower number, and Cycles loses light: a sphere with every face twice keeps
half of it, a plate nothing. Faces within a solid, where its parts touch, are not seen.
"""

from collections import Counter
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.directions import sphere
from spin_usd.geometry.triangles import areas, unit_normals
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.coincidence import GAP, coincident_faces, evenly_spread
from spin_usd.scene.derived.faces import corners_of, parts_of
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.scene.target import Target

MIN_SHARE = 1e-4  # of the target's area
LIFT = 1e-5  # of the target's radius: how far off the faces it is looked whether they are in the open
GRAZING = 0.1  # cosine below which a way out is too flat to count
WAYS = 64  # all around, tried for each face
NAMED = 3  # pairs of parts


def face_findings(target: Target) -> Iterator[Finding]:
    """Yield a warning where faces that overlap others and are in the open, each counted whole, make up MIN_SHARE of the
    target's area."""
    mesh = target.mesh
    chosen = evenly_spread(mesh)
    area = areas(corners_of(mesh, chosen))
    area /= area.sum()
    pairs = coincident_faces(mesh, chosen)
    if not len(pairs):
        return
    pairs = pairs[_in_the_open(target, pairs[:, 0])]
    area = area[np.searchsorted(chosen, pairs[:, 0])]
    share = float(area[np.unique(pairs[:, 0], return_index=True)[1]].sum())
    if share >= MIN_SHARE:
        message = (
            f"faces that hold {100 * share:.3g} % of its area overlap others ({_named(target, pairs, area)}): labels "
            "show only the first of each two, and Blender renders them too dark; remove one of each two, or move it by "
            f"more than {GAP * mesh.radius:.1g} m"
        )
        yield Finding(code="faces-coincident", where=target.path, message=message, severity=WARNING)


def _named(target: Target, pairs: NDArray[np.intp], area: Float) -> str:
    """Return the paths of the parts whose faces coincide most; `area` (K,) is the share of the first of each pair."""
    by_parts: Counter[tuple[int, int]] = Counter()
    for own, two in zip(area, np.sort(parts_of(target.mesh, pairs.ravel()).reshape(-1, 2)), strict=True):
        by_parts[int(two[0]), int(two[1])] += own
    paths = {part.id: part.path for part in target.parts}
    named = [
        f"{paths[a]} with {paths[b]}" if a != b else f"{paths[a]} with itself"
        for (a, b), _ in by_parts.most_common(NAMED)
    ]
    return ", ".join([*named, "others"] if len(by_parts) > NAMED else named)


def _in_the_open(target: Target, face: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return (N,) whether some straight way leads from just beside the middle of each face (N,), either side, to
    outside."""
    faces, which = np.unique(face, return_inverse=True)
    corners = corners_of(target.mesh, faces)
    middles, normals = corners.mean(1), unit_normals(corners)
    caster, open_faces = EmbreeCaster(), np.zeros(len(faces), bool)
    for way in sphere(WAYS):
        cosine = normals @ way
        tried = np.flatnonzero(~open_faces & (np.abs(cosine) > GRAZING))
        start = middles[tried] + LIFT * target.mesh.radius * np.sign(cosine[tried])[:, None] * normals[tried]
        open_faces[tried] = ~caster.shadowed(target, start, way)
    return np.asarray(open_faces[which])
