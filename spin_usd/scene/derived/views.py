"""Views: the target's size and distance in the pictures, and which have it out of sight or in the dark."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.identity_memo import IdentityMemo
from spin_usd.basics.json_fields import Count
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.facing import facing_share
from spin_usd.geometry.framing import Framing, framings
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.light import DistantLight, DomeLight
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import Scene

TINY = np.finfo(np.float64).tiny
FEW_PX = 5.0  # across: a target that is smaller is a dot
SMALL_SHARE = 0.1  # of the frame's shorter side
MAX_NAMES = 10  # of pictures of a kind
CHUNK = 4096  # pictures looked at together

Span = tuple[float, float]
"""The least and the most."""
UNLIT_SHARE = 0.1  # of the visible surface: if less than that faces the Sun, a renderer finds 0 to 17 % of it lit

Suns = tuple[tuple[float, float, float], ...] | None
"""Unit directions, camera frame, to the only lights of a target, distant ones; empty in the dark. None if other lights
reach it too: lamps, domes, emission."""


class ViewKind(StrEnum):
    """A kind of picture that a user may not have meant.

    The camera is inside the target's bounding box; the target is behind the camera, outside the frame or cut off by it
    (as in Framing); it is less than FEW_PX across, or less than SMALL_SHARE of the frame; the side that the camera sees
    faces away from the Sun, or no light reaches the target.
    """

    CAMERA_INSIDE = "camera_inside"
    BEHIND = "behind"
    OUTSIDE = "outside"
    CUT_OFF = "cut_off"
    FEW_PIXELS = "few_pixels"
    SMALL = "small"
    UNLIT = "unlit"
    DARK = "dark"


@dataclass(frozen=True, kw_only=True)
class PicturesOfKind:
    """The pictures of a kind."""

    count: Count
    among: Annotated[Count, Meta(description="How many were looked at.")]
    names: Annotated[tuple[str, ...], Meta(description="The first of them.")]


@dataclass(frozen=True, kw_only=True)
class Views:
    """The target's views in the pictures."""

    pictures: Count
    size: Annotated[
        tuple[float, float, float],
        Meta(description="Edges of the target's bounding box along the body's axes, metres, where it is largest."),
    ]
    distance: Annotated[
        Span, Meta(description="From the camera to the middle of that box, metres: the least and the most.")
    ]
    pixels: Annotated[
        Span | None,
        Meta(
            description="Across the ball around the target, where it is in the frame, the least and the most; null "
            "where it never is."
        ),
    ]
    of: Annotated[
        Mapping[ViewKind, PicturesOfKind],
        Meta(description="The pictures of each kind that a user may not have meant."),
    ] = field(default_factory=dict)

    def count(self, *kinds: ViewKind) -> int:
        """Return the number of pictures of one of the `kinds`, which exclude one another."""
        return sum(self.of[kind].count for kind in kinds if kind in self.of)


def views_of(
    mesh: Mesh,
    camera: Camera,
    names: Sequence[str],
    rotations: Float,
    translations: Float,
    suns: Mapping[int, Suns],
) -> Views:
    """Return the views of the pictures `names` (M), at least one, at the poses T_cam_body of `rotations` (M, 3, 3) and
    `translations` (M, 3), metres. suns: of those whose light is to be looked at, by their places among the names."""
    centres = rotations @ mesh.centre + translations
    away = np.linalg.norm(centres, axis=1)
    pixels = 2 * mesh.radius * max(camera.fx, camera.fy) / np.maximum(away, TINY)
    framing = framings(camera, mesh.hull, rotations, translations)
    shown = (framing == Framing.WHOLE) | (framing == Framing.CUT_OFF)
    lit = [i for i in suns if shown[i]]
    dark = np.array([suns[i] == () for i in lit], bool)
    unlit = lit_shares(mesh.face_axes, centres[lit], rotations[lit], [suns[i] for i in lit]) < UNLIT_SHARE
    found = {
        **{ViewKind[each.name]: np.flatnonzero(framing == each) for each in Framing if each is not Framing.WHOLE},
        ViewKind.FEW_PIXELS: np.flatnonzero(shown & (pixels < FEW_PX)),
        ViewKind.SMALL: np.flatnonzero(shown & (pixels < SMALL_SHARE * min(camera.width, camera.height))),
        ViewKind.UNLIT: np.array(lit)[unlit & ~dark],
        ViewKind.DARK: np.array(lit)[dark],
    }
    among = {kind: len(suns) if kind in (ViewKind.UNLIT, ViewKind.DARK) else len(names) for kind in ViewKind}
    x, y, z = mesh.size.tolist()
    return Views(
        pictures=len(names),
        size=(x, y, z),
        distance=_span(away),
        pixels=_span(pixels[shown]) if shown.any() else None,
        of={kind: _pictures(names, found[kind], among[kind]) for kind in ViewKind if len(found[kind])},
    )


def merged(parts: Sequence[Views]) -> Views | None:
    """Return the views of the pictures of all `parts`, in their order, where the light of all of them was looked at;
    None without parts."""
    if not parts:
        return None
    pixels = [part.pixels for part in parts if part.pixels]
    kinds = {kind for part in parts for kind in part.of}
    return Views(
        pictures=sum(part.pictures for part in parts),
        size=max((part.size for part in parts), key=max),
        distance=_span(np.array([part.distance for part in parts])),
        pixels=_span(np.array(pixels)) if pixels else None,
        of={kind: _joined(parts, kind) for kind in ViewKind if kind in kinds},
    )


class ViewCollector:
    """Looks at the target of that id in one scene after another that shows it, or at the first that each shows, and
    works out many at once; the pictures' names begin with `prefix`."""

    def __init__(self, prefix: str = "", *, target: int | None = None) -> None:
        self._prefix, self._target = prefix, target
        self._parts: list[Views] = []
        self._waiting: list[tuple[str, Float, Float, Suns]] = []
        self._suns = IdentityMemo[Suns]()
        self._mesh: Mesh | None = None
        self._camera: Camera | None = None

    def add(self, scene: Scene) -> None:
        """Look at one picture."""
        shown = next((body for body in scene.bodies if self._target in (None, body.id)), None)
        if shown is None:
            return
        mesh, camera, pose = shown.target.mesh, scene.camera, shown.T_cam_body
        if mesh is not self._mesh or camera is not self._camera or len(self._waiting) >= CHUNK:
            self._collect()
        self._mesh, self._camera = mesh, camera
        targets = (body.target for body in scene.bodies)
        suns = self._suns.of((scene.lights, scene.environment, *targets), lambda: suns_of(scene))
        self._waiting.append((self._prefix + scene.frame.name, pose.rotation, pose.translation, suns))

    def views(self) -> Views | None:
        """Return the views of all pictures so far; None before the first one."""
        self._collect()
        return merged(self._parts)

    def _collect(self) -> None:
        if self._waiting and self._mesh and self._camera:
            names, rotations, translations, suns = zip(*self._waiting, strict=True)
            poses = np.array(rotations), np.array(translations)
            self._parts.append(views_of(self._mesh, self._camera, names, *poses, dict(enumerate(suns))))
        self._waiting = []


def _span(values: Float) -> Span:
    return float(values.min()), float(values.max())


def _pictures(names: Sequence[str], found: NDArray[np.intp], among: int) -> PicturesOfKind:
    return PicturesOfKind(count=len(found), among=among, names=tuple(names[i] for i in found[:MAX_NAMES]))


def _joined(parts: Sequence[Views], kind: ViewKind) -> PicturesOfKind:
    found = [part.of[kind] for part in parts if kind in part.of]
    return PicturesOfKind(
        count=sum(each.count for each in found),
        among=sum(part.pictures for part in parts),
        names=tuple(name for each in found for name in each.names)[:MAX_NAMES],
    )


def suns_of(scene: Scene) -> Suns:
    """Return the suns of one picture. The light of planets does not count: it reaches sunlit surfaces, and is
    weaker."""
    groups = LightGroups.of(scene)
    lights = [scene.lights[i] for i in groups.placed]
    suns = [light for light in lights if isinstance(light, DistantLight)]
    domes = any(isinstance(light, DomeLight) and any(light.radiance) for light in scene.lights)
    if groups.emission or domes or len(suns) < len(lights):
        return None
    return tuple((-x, -y, -z) for x, y, z in (sun.direction_cam for sun in suns))


def lit_shares(axes: Float, centres: Float, rotations: Float, suns: Sequence[Suns]) -> Float:
    """Return (M,) the share of the visible surface in each picture that faces a Sun, 1 if other lights reach it: of the
    surface with the `axes` (A, 3) (geometry.facing), around `centres` (M, 3), camera frame, metres, rotated by
    `rotations` (M, 3, 3) from body to camera."""
    shares = np.array([float(each is None) for each in suns])
    picture = [i for i, each in enumerate(suns) for _ in each or ()]
    if picture:
        away = centres[picture] / np.maximum(np.linalg.norm(centres[picture], axis=1, keepdims=True), TINY)
        to_light = np.array([sun for each in suns for sun in each or ()])
        body = [np.einsum("mji,mj->mi", rotations[picture], towards) for towards in (-away, to_light)]
        np.maximum.at(shares, picture, facing_share(axes, *body))
    return shares
