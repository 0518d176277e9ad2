"""The points that a LiDAR measured of one picture, as those who train and test with them read them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float


@dataclass(frozen=True, kw_only=True, eq=False)
class PointCloud:
    """N points in the order of their beams. The LiDAR's axes are x forward, y left, z up; metres.

    Arrays of the file are the caller's own, to be changed at will.

    Attributes:
        table: (N,) the file's columns side by side, which the properties below give one by one.
        T_cam_lidar: (4, 4) float64, from the LiDAR's axes to the camera's: p_cam = T_cam_lidar @ (x, y, z, 1).
    """

    table: NDArray[np.void]
    T_cam_lidar: Float

    def __len__(self) -> int:
        return len(self.table)

    @property
    def points(self) -> NDArray[np.float32]:
        """(N, 3) float32: the points as measured, noise included, in the LiDAR's axes."""
        return self.table["points"]

    @property
    def points_cam(self) -> Float:
        """(N, 3) float64: the same in the camera's axes."""
        return np.asarray(self.points @ self.T_cam_lidar[:3, :3].T + self.T_cam_lidar[:3, 3])

    @property
    def ranges(self) -> NDArray[np.float32]:
        """(N,) float32: the measured ranges, noise included."""
        return self.table["ranges"]

    @property
    def exact_ranges(self) -> NDArray[np.float32]:
        """(N,) float32: the ranges without noise."""
        return self.table["exact_ranges"]

    @property
    def beams(self) -> NDArray[np.uint32]:
        """(N,) uint32: each point's beam, from 0: row i / columns and column i % columns of the pattern."""
        return self.table["beams"]

    @property
    def parts(self) -> NDArray[np.uint16]:
        """(N,) uint16: the ids of the parts that the points lie on, the keys of `Picture.parts`."""
        return self.table["parts"]

    @property
    def targets(self) -> NDArray[np.uint16]:
        """(N,) uint16: the ids of the targets that the points lie on; 0 for what is no target."""
        return self.table["targets"]
