"""The table of a Croissant export of spin_usd: CSV with q_cam_body, scalar first, and t_cam_body in metres."""

from collections.abc import Iterator
from pathlib import Path

from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows

QUATERNION = ("q_w", "q_x", "q_y", "q_z")
POSITION = ("t_x", "t_y", "t_z")
HEAD = ",".join(("name", "split", "variant", "frame", *QUATERNION, *POSITION))


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the rows of the table. Raises InputError that names the row."""
    for where, row in csv_rows(path):
        q, t = cells(row, QUATERNION, where), cells(row, POSITION, where)
        yield PoseEntry(filename=row["name"], q_cam_body=q, t_cam_body=t)


CROISSANT = PoseFormat(
    name="Croissant",
    recognises=lambda path, head: head.startswith(HEAD),
    read=read,
    lists=files_like("*.csv"),
)
