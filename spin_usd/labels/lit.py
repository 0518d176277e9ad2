"""Lit: which pixels the Sun reaches.

The Sun is the brightest distant light, taken as a point: a pixel is lit if the ray from its surface point towards the
Sun's middle hits nothing. Anything that is not cut out blocks the ray, even if transparent.
"""

from collections.abc import Iterator
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_id
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.content_keys import placed
from spin_usd.scene.derived.faces import groups_of
from spin_usd.scene.derived.shadows import in_shadow, lifted
from spin_usd.scene.derived.sunlight import brightest
from spin_usd.scene.derived.surface import Rows, Surface
from spin_usd.scene.light import DistantLight
from spin_usd.scene.scene import OneBody, Scene

ROUNDING = 1e-6  # of the cosine between a normal and the Sun, in float32


class SunState(IntEnum):
    """State of a point with respect to the Sun."""

    LIT = 1
    SHADOWED = 2
    TURNED_AWAY = 3
    NO_SUN = 4


def lit(scene: Scene, surface: Surface) -> NDArray[np.uint8]:
    """Return (H, W) uint8: the SunState; NO_SUN if there is none, planets hide it, or light links exclude it; 0 for no
    surface."""
    sun = _sun(scene)

    def states(one: OneBody, rows: Rows) -> NDArray[np.uint8] | SunState:
        return _states(scene, surface, one, rows, sun) if sun else SunState.NO_SUN

    return surface.image_of(states, (), np.uint8)


def _sun(scene: Scene) -> DistantLight | None:
    """Return the Sun that reaches the scene; None if there is none, or planets hide all of it."""
    sun = brightest(scene.lights)
    return sun if sun and sun.obscuration < 1 else None


def _states(scene: Scene, surface: Surface, one: OneBody, rows: Rows, sun: DistantLight) -> NDArray[np.uint8]:
    """Return the SunState (M,) of those points of the surface that are of the body alone in `one`."""
    mesh, normals = one.target.mesh, surface.normals[rows]
    to_sun = -one.T_cam_body.inverse().directions(sun.direction_cam)
    reached = np.ones(len(normals), bool)
    if sun.lights is not None:
        reached = np.isin(groups_of(mesh, surface.face[rows]), list(sun.lights))
    states = np.where(reached, SunState.TURNED_AWAY, SunState.NO_SUN).astype(np.uint8)
    some = np.flatnonzero(reached & (normals @ to_sun > 0))
    states[some] = SunState.LIT
    if sun.shadows:
        above = lifted(mesh, surface.body[rows][some], normals[some])
        dark = in_shadow(scene, one, above, to_sun, surface.rays, blockers=sun.shadowed_by)
        states[some[dark]] = SunState.SHADOWED
    return states


def decided_by(scene: Scene) -> Any:
    """Return the inputs of sunlight: its direction, which faces it reaches past which, and bodies outside the frame,
    whose shadows may fall into it."""
    sun = _sun(scene)
    if sun is None:
        return None
    linked = sun.lights is not None or sun.shadowed_by is not None
    groups = [body.target.mesh.shading_key for body in scene.bodies] if linked else None
    others = [placed(body) for body in scene.bodies] if scene.several else None
    return [sun.direction_cam, sun.shadows, sun.lights, sun.shadowed_by, groups, others]


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Every visible surface has a state, and surfaces turned away from the Sun agree with their normals."""
    states, ids, normals = (picture.arrays.get(name) for name in ("lit", "segmentation", "normals_cam"))
    assert states is not None
    if ids is not None and ((ids > 0) != (states > 0)).any():
        yield LabelFault(code="support", message="segmentation and lit cover different pixels")
    if normals is not None and picture.towards_sun is not None:
        cosine = normals.astype(np.float64) @ picture.towards_sun
        wrong = int((((states == SunState.LIT) | (states == SunState.SHADOWED)) & (cosine < -ROUNDING)).sum())
        wrong += int(((states == SunState.TURNED_AWAY) & (cosine > ROUNDING)).sum())
        if wrong:
            message = f"lit and normals_cam disagree in {wrong} pixels on surfaces turned away from the Sun"
            yield LabelFault(code="lit", message=message)


LIT = Label(
    name="lit",
    make=lit,
    decided_by=decided_by,
    channels=Channels(
        meaning="what the Sun does, 8-bit: 1 = lit, 2 = in a shadow, 3 = turned away, 4 = no Sun there; 0 = nothing",
        dtype="uint8",
        holds={"Y": "what the Sun does"},
    ),
    suffix=".png",
    usd_type="int",
    file_bytes=0.02,
    target_s=1.2e-07,
    preview=by_id,
    faults=faults,
)
