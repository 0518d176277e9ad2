"""An export --to unknown_target, as a method that reconstructs a shape reads it."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET
from msgspec.json import decode
from numpy.typing import NDArray

from spin_usd.exchange.unknown_target import UnknownTarget, UnknownView
from spin_usd.formats.image_file import read_image
from spin_usd.geometry.camera import Camera

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Exported:
    """The pictures of the export in a folder; nothing of its truth."""

    folder: Path

    @cached_property
    def views(self) -> list[UnknownView]:
        return decode((self.folder / "frames.json").read_bytes(), type=UnknownTarget).frames

    @property
    def posed(self) -> bool:
        return self.views[0].T_cam_body is not UNSET

    @property
    def masked(self) -> bool:
        return self.views[0].mask is not UNSET

    def mask(self, view: UnknownView) -> NDArray[np.bool_]:
        """(H, W): where the target is."""
        return read_image(self.folder / str(view.mask))[0] > 0


def camera_of(view: UnknownView) -> Camera:
    """The view's camera; (0, 0) is the corner of the image."""
    (fx, _, cx), (_, fy, cy), _ = view.K
    lens = tuple(view.distortion)
    return Camera(width=view.width, height=view.height, fx=fx, fy=fy, cx=cx, cy=cy, distortion=lens)


def pose_of(view: UnknownView) -> Floats:
    """(4, 4) T_cam_body."""
    return np.array(view.T_cam_body)


def centres_of(low: Floats, step: float, shape: NDArray[Any]) -> Floats:
    """(N, 3) the centres of a grid's cells: `low` is its corner, `step` the edge of a cell."""
    numbers = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3)
    return low + (numbers + 0.5) * step


def write_cloud(path: Path, points: Floats) -> None:
    """Write points (N, 3), metres, as PLY."""
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    names = "".join(f"property double {axis}\n" for axis in "xyz")
    path.write_bytes(f"{head}{names}end_header\n".encode() + np.ascontiguousarray(points, "<f8").tobytes())


def write_surface(path: Path, values: Floats, low: Floats, step: float) -> Path:
    """Write as PLY where values (X, Y, Z) at the centres of a grid's cells are 0, found by marching cubes."""
    import trimesh
    from skimage.measure import marching_cubes

    points, faces, _, _ = marching_cubes(values, 0.0)
    trimesh.Trimesh(low + (points + 0.5) * step, faces[:, ::-1], process=False).export(path)
    return path
