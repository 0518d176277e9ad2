"""Where each pixel's own ray meets the triangle that the renderer saw there, in double precision.

A renderer only decides *which* triangle a pixel shows; this file decides *where* on it, from the camera and the
mesh alone. So no renderer's float32 enters a label, and two renderers that see the same triangle agree to the bit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.region import Region
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Visibility

GRAZING = 1e-12  # |cosine| x area below which a ray runs within its triangle's plane


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """The visible points of the target: N pixels of `region`, in row-major order.

    rows, columns (N,) pixel indices in the whole frame · face (N,) · part (N,) uint16 ids · z (N,) planar depth in
    metres · body (N, 3) metres in body axes.
    """

    region: Region
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    face: NDArray[np.int32]
    part: NDArray[np.uint16]
    z: Float
    body: Float


def visible_surface(scene: Scene, visibility: Visibility) -> Surface:
    """The surface points behind the visible faces.

    The point lies exactly on the pixel's ray. Where the ray misses its triangle by rounding, or runs within its plane,
    depth is kept within the triangle's own.
    """
    mesh = scene.target.mesh
    rows, columns = np.nonzero(visibility.face >= 0)
    face = visibility.face[rows, columns]
    rows, columns = rows + visibility.region.y0, columns + visibility.region.x0
    rays = scene.camera.rays(np.stack([columns + 0.5, rows + 0.5], -1)) if len(rows) else np.zeros((0, 3))
    corners = scene.T_cam_body.points(mesh.points)[mesh.faces[face]]
    z = _plane_depth(rays, corners)
    return Surface(
        region=visibility.region,
        rows=rows,
        columns=columns,
        face=face,
        part=mesh.face_part[face],
        z=z,
        body=scene.T_cam_body.inverse().points(z[:, None] * rays),
    )


def shading_normals(scene: Scene, surface: Surface) -> Float:
    """Unit shading normals (N, 3) in body axes, turned to face the camera."""
    mesh = scene.target.mesh
    weights = _barycentric(surface.body, mesh.points[mesh.faces[surface.face]])
    normals = (weights[..., None] * mesh.corner_normals[surface.face]).sum(1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    eye = scene.T_cam_body.inverse().translation
    away = (normals * (surface.body - eye)).sum(1) > 0
    return np.where(away[:, None], -normals, normals)


def _plane_depth(rays: Float, corners: Float) -> Float:
    """z (N,) at which `rays` (N, 3), z = 1, from the origin meet the planes of the triangles (N, 3, 3).

    Subtracting before multiplying keeps the target's own scale: only z of the first corner carries the range.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    slope = (normal * rays).sum(1)
    scale = np.linalg.norm(normal, axis=1) * np.linalg.norm(rays, axis=1)
    offset = (normal * (a - a[:, 2:] * rays)).sum(1)
    flat = np.abs(slope) <= GRAZING * scale
    z = a[:, 2] + np.where(flat, 0, offset / np.where(flat, 1, slope))
    low, high = corners[..., 2].min(1), corners[..., 2].max(1)
    return np.clip(z, low, high)


def _barycentric(points: Float, corners: Float) -> Float:
    """Weights (N, 3) of the points (N, 3) in their triangles (N, 3, 3), clipped to the triangle and summing to 1."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    w = points - a
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    wu, wv = (w * u).sum(1), (w * v).sum(1)
    det = np.maximum(uu * vv - uv * uv, np.finfo(float).tiny)
    beta, gamma = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    weights = np.clip(np.stack([1 - beta - gamma, beta, gamma], -1), 0, 1)
    return weights / np.maximum(weights.sum(1, keepdims=True), np.finfo(float).tiny)
