"""CubeSat-CDT: as SPARK's stream 2. Its own annotation files are not published; they come from the same laboratory."""

from collections.abc import Mapping
from typing import Any

from spin_usd.dataset.export.layout.layout import ExportFormat, Layout
from spin_usd.dataset.export.layout.pose_table import pose_table_layout

ASSUMED = "The layout is assumed: that of SPARK's stream 2, of the same laboratory; CubeSat-CDT's own is not published."


def layout(options: Mapping[str, Any]) -> Layout:
    """Return the layout, which has no options."""
    return pose_table_layout(notes=(ASSUMED,))


CUBESAT_CDT = ExportFormat(
    name="cubesat_cdt", holds="in an assumed layout of CubeSat-CDT: the poses of trajectories as CSV", layout=layout
)
