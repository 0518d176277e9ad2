"""A stage of a craft that turns and moves past an event camera, as a list of poses with times makes it."""

from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.commands.author.in_child import author_stage

SECONDS = (0.0, 0.5, 1.0, 1.5, 2.0)


def author_moving(
    folder: Path,
    *,
    rate: float = 10.0,
    start: float = -0.02,
    speed: float = 0.02,
    distance: float = 0.6,
    sensor: str | None = "ideal",
    **options: Any,
) -> Path:
    """Author it in the new `folder`, and return its root layer. rate: degrees a second; start: metres beside the axis;
    speed: m/s across; sensor: the event camera's, None for none."""
    axis = np.array([0.6, 0.64, 0.48])
    lines = ["name,qw,qx,qy,qz,x,y,z,time"]
    for number, time in enumerate(SECONDS):
        half = np.radians(30 + rate * time) / 2
        q = [np.cos(half), *(np.sin(half) * axis)]
        place = [start + speed * time, 0.01, distance]
        lines.append(",".join([f"p{number}", *(f"{value:.12f}" for value in (*q, *place)), str(time)]))
    folder.mkdir(parents=True)
    (folder / "poses.csv").write_text("\n".join(lines) + "\n")
    more = {"resolution": "96", "sun_direction": (0.3, -0.2, -1), **options}
    made = author_stage(
        poses=folder / "poses.csv", target="cubesat", camera="spin", out=folder / "stage", event_sensor=sensor, **more
    )
    return Path(made.root)
