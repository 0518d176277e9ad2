"""How far a pass's labels are from the truth, and how far arithmetic allows them to be.

All bounds are of roundings: half a unit in the last place of a double, U64, or of a float32, U32, times how many of
them there can be in a row, times the size of the numbers that are rounded. None is taken from a result.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spin_usd.labels.dense_pose import dense_pose
from spin_usd.labels.depth import depth
from spin_usd.renderers.camera_shader import View
from spin_usd.scene.derived.surface import visible_surface
from tests.extremes import exact

U32, U64 = 2.0**-24, 2.0**-53
# A label's number passes through the rotation's entries (6 roundings), its product with a point (6), the pixel's ray
# (3), the ray's point at the centre's depth (4), the plane's normal (9) and the step to it (4).
DOUBLES = 32
# What decides which triangle a pixel shows, in float32: the corners, the rotation, the ray's start and direction, their
# products (12), and the triangle's edges seen from the ray's start (12).
FLOATS = 32
# Cycles sends the first ray of its own camera 0.0005 px beside the centre (0.0007 px at most was measured); the
# camera shader puts it back.
FIRST_RAY_PX = 1e-3
# Roundings of a pixel's coordinate on its way through the shader, and of the lens's inverse there.
PIXEL_FLOATS = 16
INVERSE_PX = 1e-4  # what the shader's lens inverse is allowed to leave (rays.INVERSE_ERROR_PX), and its last step


@dataclass(frozen=True, kw_only=True)
class Judged:
    """errors and bounds by quantity, one number for each pixel (N,) that shows the same face as the truth: "depth"
    relative to itself, "body" relative to the target's radius, "reprojection" in pixels. wrong: how many pixels show
    another face, or none, or one where there is none; near: how many lie so near an edge or another surface that
    float32 may decide otherwise; unexcused: those of `wrong` that are not `near`. nearest: least depth seen, metres."""

    errors: dict[str, np.ndarray]
    bounds: dict[str, np.ndarray]
    seen: int
    wrong: int
    near: int
    unexcused: int
    nearest: float


def judged(case, label_pass):
    """The labels of a `case` by a label pass."""
    s = case.scene()
    visibility = label_pass.visibility(s)
    surface = visible_surface(s, visibility)
    face = np.full(s.camera.frame.shape, -1)
    face[surface.rows, surface.columns] = surface.face
    labels = depth(s, surface).ravel(), dense_pose(s, surface).reshape(-1, 3)
    return _Judge(case, s, truth(case), face.ravel()).judged(*labels, blender=label_pass.name == "blender")


@lru_cache
def truth(case):
    """Once for all passes."""
    return exact.hits(case.camera, case.q, case.t, *case.mesh)


class _Judge:
    def __init__(self, case, s, true, face) -> None:
        self.case, self.scene, self.true, self.face = case, s, true, face
        self.mesh = s.target.mesh
        self.R, self.t = exact.rotation(case.q), np.asarray(case.t, exact.Long)
        self.corners = (np.asarray(self.mesh.points, exact.Long) @ self.R.T + self.t)[self.mesh.faces]
        self.d = np.concatenate([true.rays, np.ones((len(true.rays), 1), exact.Long)], 1)
        self.length = np.linalg.norm(self.d.astype(float), axis=1)

    def judged(self, z, body, *, blender):
        reach = self._reach(blender)
        near = self._near(reach, blender)
        same = self._same()
        wrong = ~same & ((self.face >= 0) | (self.true.face >= 0))
        both = same & (self.face >= 0)
        errors, bounds = self._errors(z, body, both)
        return Judged(
            errors=errors,
            bounds=bounds,
            seen=int((self.true.face >= 0).sum()),
            wrong=int(wrong.sum()),
            near=int(near.sum()),
            unexcused=int((wrong & ~near).sum()),
            nearest=float(self.true.z[self.true.face >= 0].min(initial=np.inf)),
        )

    def _same(self):
        """(N,) whether the face is the true one, or one that lies in it."""
        same = self.face == self.true.face
        for i in np.flatnonzero(~same & (self.face >= 0) & (self.true.face >= 0)):
            at, weights = exact.on_plane(self.d[i : i + 1], *self.corners[self.face[i]])
            same[i] = (weights >= 0).all() and abs(at[0] - self.true.z[i]) <= 64 * exact.HALF_ULP * self._size
        return same

    @property
    def _size(self):
        """The largest number that a place is made of: range and radius, metres."""
        centre = np.linalg.norm((self.R @ self.mesh.centre + self.t).astype(float))
        return float(centre) + self.mesh.radius

    def _errors(self, z, body, both):
        true, d = self.true, self.d[both]
        wanted = true.z[both]
        dz = np.abs(z[both] - wanted).astype(float)
        off = np.abs(body[both] - true.body[both]).astype(float)
        seen = exact.project(self.case.camera, body[both] @ self.R.T + self.t)
        asked = exact.project(self.case.camera, np.where(wanted[:, None] > 0, wanted[:, None], 1) * d)
        rounded, slide = self._rounded(both), self._slide(both)
        kept = U32 * np.abs(true.body[both]).astype(float)
        coordinates = kept + slide[:, None] * self.length[both][:, None]
        across = np.linalg.norm(kept, axis=1) + rounded  # along its ray a point may slide and be seen where it was
        depth_m, focal = wanted.astype(float), max(self.case.camera.fx, self.case.camera.fy)
        ahead = np.maximum(depth_m - across, np.finfo(float).tiny)
        errors = {
            "depth": dz / depth_m,
            "body": off.max(1) / self.mesh.radius,
            "reprojection": np.linalg.norm((seen - asked).astype(float), axis=1),
        }
        bounds = {
            "depth": U32 + slide / depth_m,
            "body": coordinates.max(1) / self.mesh.radius,
            "reprojection": focal * true.most[both].astype(float) * across * self.length[both] / ahead,
        }
        return errors, bounds

    def _rounded(self, both):
        """(M,) metres that roundings of doubles move a point across its ray: of the range and the radius, more where
        the lens is flat."""
        lens = 1 / self.true.least[both].astype(float)
        return DOUBLES * U64 * (self.true.z[both].astype(float) * self.length[both] * lens + self._size)

    def _slide(self, both):
        """(M,) metres of depth that they move it along its ray: more where the triangle is thin, so that its plane may
        tilt, divided by the cosine under which it is seen."""
        a, b, c = self.corners[self.face[both]].astype(float).swapaxes(0, 1)
        normal = np.cross(b - a, c - a)
        area = np.linalg.norm(normal, axis=1)
        longest = np.max([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
        slope = np.abs((normal * self.d[both].astype(float)).sum(1)) / area
        return (self._rounded(both) + DOUBLES * U64 * self.mesh.radius * longest**2 / area) / slope

    def _reach(self, blender):
        """Metres across a ray that float32 may be off at the target: roundings of numbers of the target's own size, or
        of the range where the renderer's origin is the camera."""
        if not blender:
            return FLOATS * U32 * self.mesh.radius
        view = View.sharp(self.scene.one_body_scenes[0])
        return FLOATS * U32 * ((view.distance if view.near else 0) + self.mesh.radius)

    def _near(self, reach, blender):
        """(N,) whether another answer lies within the float32 roundings of the pixel's ray: an edge of a triangle
        beside it, or a second surface just before or behind the first."""
        camera, view = self.case.camera, View.sharp(self.scene.one_body_scenes[0])
        focal = max(camera.fx, camera.fy)
        pixel = 0.0
        if blender:
            widest = max(camera.width, camera.height, abs(camera.cx), abs(camera.cy))
            pixel = PIXEL_FLOATS * U32 * widest + (FIRST_RAY_PX if view.plain else INVERSE_PX * camera.distorted)
        aside = pixel / focal / np.minimum(self.true.least.astype(float), 1.0)
        near = np.zeros(len(self.d), bool)
        rays = self.true.rays.astype(float)
        for a, b, c in self.corners.astype(float):
            for start, end in ((a, b), (b, c), (c, a)):
                near |= _passes(rays, start, end, aside, reach)
        return near | self._tied(reach)

    def _tied(self, reach):
        """(N,) whether two surfaces that do not coincide lie as near to each other as depth is uncertain."""
        tied = np.zeros(len(self.d), bool)
        for a, b, c in self.corners:
            at, weights = exact.on_plane(self.d, a, b, c)
            normal = np.cross(b - a, c - a)
            slope = np.abs(self.d @ normal) / np.linalg.norm(normal) / self.length
            gap = np.abs(at - self.true.z) * self.length
            inside = (weights >= 0).all(0) & (self.true.face >= 0)
            tied |= inside & (gap > 64 * exact.HALF_ULP * self._size) & (gap <= 2 * reach / np.maximum(slope, 1e-300))
        return tied


def _passes(rays, start, end, aside, reach):
    """(N,) whether the rays (N, 2) pass the segment from `start` to `end` (3,) within `aside` (N,) normalised, or
    `reach` metres where it is."""
    if start[2] > end[2]:
        start, end = end, start
    least = 1e-9 * max(np.linalg.norm(start), np.linalg.norm(end))
    if end[2] <= least:
        return np.zeros(len(rays), bool)
    if start[2] < least:
        start = start + (least - start[2]) / (end[2] - start[2]) * (end - start)
    a, b = start[:2] / start[2], end[:2] / end[2]
    along = b - a
    square = float(along @ along)
    share = np.clip(((rays - a) @ along) / square, 0, 1) if square else np.zeros(len(rays))
    gap = np.linalg.norm(rays - a - share[:, None] * along, axis=1)
    z = 1 / ((1 - share) / start[2] + share / end[2])  # 1 / z is linear in the picture
    return gap <= aside + reach * np.sqrt(1 + (rays**2).sum(1)) / z
