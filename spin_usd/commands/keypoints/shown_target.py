"""The target that keypoints are picked on: its surface, and the rays that meet it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.commands.keypoints.calls import SavedTarget
from spin_usd.geometry.facet import Facet
from spin_usd.geometry.snapping import Snap, met_at, snap_places
from spin_usd.geometry.triangles import unit_vectors
from spin_usd.picture.keypoint_states import skin
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.target import Part, Target

FAR = 100.0  # radii from the target's centre, of views from far away


@dataclass(frozen=True, kw_only=True, eq=False)
class Pick:
    """A point of the surface that was picked."""

    facet: Facet
    """All of the surface in one plane around it."""
    places: Mapping[Snap, Float]
    """(3,), body axes, metres: where each way to snap puts it."""

    @classmethod
    def at(cls, point: Float) -> "Pick":
        """Return the pick of a point (3,) that is to go nowhere else."""
        return cls(facet=Facet(corners=np.zeros((0, 3, 3))), places=dict.fromkeys(Snap, point))


@dataclass(frozen=True, kw_only=True, eq=False)
class ShownTarget:
    """A target as the keypoint tool has it."""

    body: Target
    """Its surface, body axes, metres."""
    colors: Float
    """(F, 3): colours of its faces, linear."""
    notes: tuple[str, ...]
    """On how its file was read."""

    @classmethod
    def of(cls, read: SavedTarget, arrays: Path) -> "ShownTarget":
        """Return the target that a child process has read, and whose surface it saved in the file `arrays`."""
        with np.load(arrays) as saved:
            mesh = _plain_mesh(saved["points"], saved["faces"])
            colors = saved["colors"]
        name = read.name
        part = Part(id=1, path="/Target", name=name, class_name="")
        body = Target(path="/Target", name=name, mesh=mesh, parts=(part,), materials=(Material(path="/Target"),))
        own = Keypoints(names=read.keypoints.names, points=np.array(read.keypoints.points, np.float64).reshape(-1, 3))
        body = replace(body, keypoint_names=own.names, keypoints=own.points)
        return cls(body=body, colors=colors, notes=read.notes)

    @property
    def mesh(self) -> Mesh:
        """The surface."""
        return self.body.mesh

    @cached_property
    def caster(self) -> EmbreeCaster:
        """Finds the faces that rays hit."""
        return EmbreeCaster()

    def with_keypoints(self, keypoints: Keypoints) -> Target:
        """Return the body with these keypoints instead of its own."""
        return replace(self.body, keypoint_names=keypoints.names, keypoints=keypoints.points)

    def pick(self, origin: Float, direction: Float) -> Pick | None:
        """Return the first hit of the ray from `origin` (3,) along `direction` (3,), body axes, metres; None if there
        is none. Embree finds the face; the point is computed in double precision."""
        along = unit_vectors(direction)
        face = int(self.caster.first_faces(self.body, origin - self.mesh.centre, along[None])[0])
        if face < 0:
            return None
        facet = Facet.around(self.mesh.points, self.mesh.faces, face)
        met = origin + along * met_at(origin, along, self.mesh.points[self.mesh.faces[face]])
        return Pick(facet=facet, places=snap_places(met, facet))

    def seen_share(self, points: Float, directions: Float) -> Float:
        """Return (N,) the share of views, from far away along the unit `directions` (V, 3), in which nothing hides each
        of the `points` (N, 3), by the records' rule of visibility."""
        eyes = self.mesh.centre + FAR * self.mesh.radius * directions
        return np.asarray(np.mean([self._seen(points, eye) for eye in eyes], axis=0))

    def _seen(self, points: Float, eye: Float) -> NDArray[np.bool_]:
        towards = points - eye
        distance = np.linalg.norm(towards, axis=1)
        rays = towards / distance[:, None]
        face = self.caster.first_faces(self.body, eye - self.mesh.centre, rays)
        met = np.flatnonzero(face >= 0)
        before = np.full(len(points), np.inf)
        before[met] = met_at(eye, rays[met], self.mesh.points[self.mesh.faces[face[met]]])
        return np.asarray(before > distance - skin(self.mesh.size))

    def behind(self, origin: Float, pick: Pick | None) -> float:
        """Return the distance from `origin` (3,) beyond which a point is hidden by the picked face; infinity if none
        was picked."""
        if pick is None:
            return np.inf
        return float(np.linalg.norm(pick.places[Snap.SURFACE] - origin)) + skin(self.mesh.size)


def _plain_mesh(points: Float, faces: NDArray[np.int32]) -> Mesh:
    """Return a mesh of one part and one material, with dummy normals."""
    count = len(faces)
    return Mesh(
        points=points,
        faces=faces,
        face_part=np.ones(count, np.uint16),
        face_material=np.zeros(count, np.int32),
        corner_normals=np.zeros((count, 3, 3), np.float32),
    )
