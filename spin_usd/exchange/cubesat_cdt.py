"""CubeSat-CDT: as SPARK's stream 2.

Its own annotation files are not published; they come from the same laboratory.
"""

from spin_usd.exchange.layout.export_format import ExportFormat
from spin_usd.exchange.spark import pose_table_layout

ASSUMED = "The layout is assumed to be SPARK's stream 2, from the same laboratory; CubeSat-CDT's own is not published."


CUBESAT_CDT = ExportFormat(
    name="cubesat_cdt",
    holds="in an assumed layout of CubeSat-CDT: the poses of trajectories as CSV",
    layout=pose_table_layout(notes=(ASSUMED,)),
)
