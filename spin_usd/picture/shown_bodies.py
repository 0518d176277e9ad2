"""The body that each pixel of a picture shows."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.geometry.region import Region
from spin_usd.labels.instance import INSTANCE
from spin_usd.labels.segmentation import SEGMENTATION
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.faces import by_body
from spin_usd.scene.scene import Scene

NOTHING = -1
SUPPORTS = ("depth", "range", "dense_pose")  # labels that are 0 exactly where no body is
TELLING = (SEGMENTATION.name, INSTANCE.name, *SUPPORTS)
"""Labels that may tell bodies apart."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ShownBodies:
    """ids (rows, columns) int32: the id of the body that the ray through each pixel centre of `region` meets first, 0
    of an occluder, NOTHING if it meets none. Outside the region there are no bodies."""

    region: Region
    ids: NDArray[np.int32]

    def box(self, body: int) -> list[int] | None:
        """Return the tight box x0, y0, x1, y1 around the pixels that show the body of that id, x1 and y1 past the last;
        None if no pixel shows it."""
        shows = self.ids == body
        rows, columns = np.flatnonzero(shows.any(1)), np.flatnonzero(shows.any(0))
        if not len(rows):
            return None
        x0, y0 = self.region.x0, self.region.y0
        return [int(x0 + columns[0]), int(y0 + rows[0]), int(x0 + columns[-1] + 1), int(y0 + rows[-1] + 1)]


def shown_by_label(scene: Scene, kind: str, array: NDArray[Any]) -> ShownBodies | None:
    """Return the bodies that a label of that kind shows; None if it does not tell them apart.

    The label instance does not tell an occluder from nothing: all its pixels without a target count as occluder.
    """
    if kind not in TELLING:
        return None
    values, several = array[scene.region.slices], len(scene.bodies) > 1
    if kind == SEGMENTATION.name:
        bodies = np.array([NOTHING, *(body.id for body in scene.bodies)], np.int32)
        return ShownBodies(region=scene.region, ids=bodies[np.searchsorted(scene.part_offsets, values)])
    if kind == INSTANCE.name and several:
        return ShownBodies(region=scene.region, ids=values.astype(np.int32))
    if kind in SUPPORTS and not several:
        seen = values.any(-1) if values.ndim > 2 else values > 0
        return ShownBodies(region=scene.region, ids=np.where(seen, scene.bodies[0].id, NOTHING).astype(np.int32))
    return None


def shown_by_rays(scene: Scene, caster: EmbreeCaster) -> ShownBodies:
    """Return the bodies that the pixels' own rays meet, if no label contains them."""
    seen = caster.visibility(scene)
    ids = np.full(seen.face.size, NOTHING, np.int32)
    for of in by_body(scene, seen.face.ravel()):
        ids[of.rows] = scene.bodies[of.place].id
    return ShownBodies(region=seen.region, ids=ids.reshape(seen.face.shape))
