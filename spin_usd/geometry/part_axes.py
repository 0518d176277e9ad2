"""A part of a craft as a piece: its root, where it meets the rest, its longest axis, and the frame of its bend."""

from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.triangles import areas, cross, dot, lengths, unit_normals, unit_vectors

NEAR = 0.01  # of the longest edge of the part's box, within which it meets the rest
TIE = 0.01  # share by which two widths may differ and count as equal
MAX_POINTS = 512  # of each side, evenly chosen, whose distances are taken
ALONG = np.cos(np.radians(1))  # of a direction to a body axis, to which it is rounded then
TINY = np.finfo(float).tiny


@dataclass(frozen=True, kw_only=True, eq=False)
class PartAxes:
    """A part's root and longest axis."""

    corners: Float
    """(F, 3, 3) the part's triangles."""
    root: Float
    """(3,): the centre of the box around all points of either surface, part and rest, that are as near to the other
    one as the nearest of them, or within NEAR of it; the part's own centre if there is no rest."""

    @classmethod
    def of(cls, corners: Float, rest: Float) -> "PartAxes":
        """Find the root of the part with the triangles `corners` (F, 3, 3) on the `rest` (G, 3, 3) of its craft."""
        low, high = corners.min((0, 1)), corners.max((0, 1))
        if not len(rest):
            return cls(corners=corners, root=(low + high) / 2)
        near = NEAR * float((high - low).max())
        reach = near + float(nearest(_some(corners), rest)[0].min())
        rest = rest[((rest.min(1) <= high + reach) & (rest.max(1) >= low - reach)).all(1)]
        inside = ((rest >= low - reach) & (rest <= high + reach)).all(-1)
        sides = [(_some(corners), rest), (_some(rest[inside]), corners)]
        points = np.concatenate([some for some, _ in sides])
        away = np.concatenate([nearest(some, others)[0] for some, others in sides])
        meeting = points[away <= away.min() + near]
        return cls(corners=corners, root=(meeting.min(0) + meeting.max(0)) / 2)

    @property
    def longest(self) -> Float:
        """(3,) unit direction in which the surface is widest spread, outwards from the root. Where two widths are equal
        within TIE, the body axis nearest to both decides, x before y before z; within 1 degree of a body axis it is
        that axis."""
        size, directions = np.linalg.eigh(self._spread)
        return self._outwards(_decided(directions[:, size >= size[2] * (1 - TIE)]))

    @property
    def length(self) -> Float:
        """(3,) the longest axis, or the one square to it in the part's plane if its centre lies more that way from the
        root: a wing that is fixed by its longer edge goes away from that edge."""
        longest = self.longest
        other = np.cross(self._thinnest(longest), longest)
        ways = np.abs(np.stack([longest, other]) @ self._centre)
        return other if ways[1] > ways[0] + NEAR * np.ptp(self.corners, axis=(0, 1)).max() else longest

    def _thinnest(self, x: Float) -> Float:
        """Return the direction (3,) square to `x` in which the surface is least spread."""
        square = np.eye(3) - np.outer(x, x)
        size, directions = np.linalg.eigh(square @ self._spread @ square + np.trace(self._spread) * np.outer(x, x))
        found = _decided(directions[:, size <= size[0] + TIE * size[1]])
        return np.asarray(unit_vectors(found - (found @ x) * x))

    def bend_frame(self, along: Float) -> tuple[Float, float]:
        """Return the frame (4, 4) of a bend along that direction (3,), and its length: from the root outwards, in the
        middle of the part's thickness, towards its thinnest side; the greatest number of that direction is positive."""
        x = self._outwards(along)
        z = self._thinnest(x)
        z = z * np.sign(z[np.argmax(np.abs(z).round(6))])
        local = (self.corners.reshape(-1, 3) - self.root) @ np.stack([x, z], axis=1)
        frame = np.eye(4)
        frame[:3] = np.stack([x, np.cross(z, x), z, self.root + z * (local[:, 1].min() + local[:, 1].max()) / 2], 1)
        return frame, float(max(local[:, 0].max(), TINY))

    def _outwards(self, along: Float) -> Float:
        """Return the direction or its opposite: the one that leads from the root to the part's centre."""
        way = float(self._centre @ along)
        if abs(way) < NEAR * float(np.ptp(self.corners, axis=(0, 1)).max()):
            way = along[np.argmax(np.abs(along).round(6))]
        return along if way >= 0 else -along

    @property
    def _centre(self) -> Float:
        """(3,) from the root to the centre of the part's box."""
        centre: Float = (self.corners.min((0, 1)) + self.corners.max((0, 1))) / 2 - self.root
        return centre

    @property
    def _spread(self) -> Float:
        """(3, 3): the second moments of the surface about its centre."""
        area = areas(self.corners)
        total = max(float(area.sum()), TINY)
        around = self.corners - (self.corners.mean(1) * area[:, None]).sum(0) / total
        sums = around.sum(1)
        spread: Float = np.einsum("f,fij,fik->jk", area, around, around) + np.einsum("f,fj,fk->jk", area, sums, sums)
        return spread / (12 * total)


def _decided(directions: Float) -> Float:
    """Return one unit vector of the space of `directions` (3, N)."""
    within = directions @ directions.T
    decided: Float = unit_vectors(within[:, np.argmax(np.diag(within).round(6))])
    return np.round(decided) if np.abs(decided).max() > ALONG else decided


def _some(corners: Float) -> Float:
    """Return (P, 3) corners, each once, evenly chosen if there are many."""
    points = np.unique(corners.reshape(-1, 3), axis=0)
    return np.asarray(points[np.linspace(0, len(points) - 1, min(len(points), MAX_POINTS)).astype(int)])


def nearest(points: Float, corners: Float) -> tuple[Float, Float]:
    """Return (N,) the distance of each point (N, 3) from the nearest of the triangles (F, 3, 3), and that one's
    number."""
    middles = corners.mean(1)
    radii = lengths(corners - middles[:, None]).max(1)
    found = [_nearest(point, corners, lengths(middles - point), radii) for point in points]
    return np.array([away for away, _ in found]), np.array([face for _, face in found], np.intp)


def _nearest(point: Float, corners: Float, away: Float, radii: Float) -> tuple[float, int]:
    near = np.flatnonzero(away - radii <= (away + radii).min())
    some = corners[near]
    edges, to_point = np.roll(some, -1, axis=1) - some, point - some
    share = np.clip(dot(to_point, edges) / np.maximum(dot(edges, edges), TINY), 0, 1)
    distances = lengths(to_point - share[..., None] * edges).min(1)
    normals = unit_normals(some)
    above = (dot(cross(edges, to_point), np.broadcast_to(normals[:, None], edges.shape)) > 0).all(1)
    distances = np.where(above, np.abs(dot(to_point[:, 0], normals)), distances)
    return float(distances.min()), int(near[np.argmin(distances)])
