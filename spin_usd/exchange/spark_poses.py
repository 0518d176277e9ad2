"""The pose lists of SPARK's stream 2, which CubeSat-CDT is taken to share: CSV.

Each row has a file name, the sequence that it belongs to, t_cam_body in metres and q_cam_body, scalar last. A file name
is unique in its sequence alone. Source: the files of SPARK 2022 and 2024, stream 2.
"""

from collections.abc import Iterator
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import SCALAR_LAST, PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows

POSITION = ("Tx", "Ty", "Tz")
QUATERNION = ("Qx", "Qy", "Qz", "Qw")
HEAD = ",".join(("filename", "sequence", *POSITION, *QUATERNION))


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the rows of the file. Raises InputError that names the row."""
    rows = list(csv_rows(path))
    names = [row.get("filename", "") for _, row in rows]
    repeated = len(set(names)) < len(names)
    for (where, row), name in zip(rows, names, strict=True):
        if not name:
            raise InputError("has no filename", where=where, do=f"give {HEAD}")
        x, y, z, w = cells(row, QUATERNION, where)
        filename = f"{row.get('sequence', '')}_{name}" if repeated else name
        yield PoseEntry(filename=filename, q_cam_body=(w, x, y, z), t_cam_body=cells(row, POSITION, where))


STREAM_2 = PoseFormat(
    name="SPARK's stream 2",
    recognises=lambda path, head: head.replace(" ", "").startswith(HEAD),
    read=read,
    lists=files_like("*.csv", "*/*.csv"),
    rotation=SCALAR_LAST,
)
