"""The pictures of a scenario: the target's poses, and Sun, Earth, Moon and stars where they are then."""

from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.progress import Progress
from spin_usd.basics.resources import bundled
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.checked_document import read_as
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.formats.text_file import read_toml_file
from spin_usd.orbits.epochs import CREDIT, stars
from spin_usd.orbits.scenario import Scenario, Seen, quaternions_of, see
from spin_usd.scene.poses import PoseList
from spin_usd.stage.augment.placed_sky import PlacedSky
from spin_usd.stage.augment.sampled_values import SampledValues, open_base

ENVIRONMENT = "near_earth"
NO_STARS = -2.0  # magnitude: none is brighter but the Sun
ECLIPTIC_POLE = (0.0, -0.3977771559319137, 0.9174820620691818)  # ICRF; obliquity of J2000, 84381.406 arcseconds


class ScenarioPictures:
    """The pictures of the scenario in a file that `frames` selects.

    files: their sources, by their roles · whole: the number of all pictures · poses: the target's, with their rates.
    """

    def __init__(self, given: str | Path, frames: str | None, progress: Progress) -> None:
        """Raises InputError."""
        file = Path(given) if Path(given).suffix.lower() == ".toml" else bundled("scenario", str(given))
        tables = read_toml_file(file, MAX_SPECIFICATION)
        tables["epoch"] = str(tables.get("epoch", ""))  # TOML has dates of its own
        scenario = read_as(Scenario, tables, file)
        self.files = {"scenario": file}
        self.files |= {f"scenario_{number}": file.parent / name for number, name in enumerate(scenario.files, 1)}
        count = len(scenario.seconds)
        rows = range(count) if frames is None else range(count)[slice_of(frames)]
        if not rows:
            raise InputError(f"frames {frames!r} chooses none of {count} pictures", where=file)
        self.whole = count
        try:
            self._seen = see(scenario, scenario.seconds[list(rows)], file.parent, progress)
            self._stars = _stars(scenario, self._seen.year)
        except InputError as error:
            where = str(error.where or "")
            if not where.startswith(str(file.parent)):
                where = f"{file}, {where}" if where else str(file)
            raise InputError(error.found, where=where, do=error.do) from None
        self.poses = _listed(self._seen, rows, scenario, str(file))

    def light(self, stage: Any) -> SampledValues:
        """Return the values that place Sun, planets and stars in the opened `stage`."""
        seen = self._seen
        sky = PlacedSky(
            sun=seen.sun,
            planets={"Earth": (seen.R_cam_earth, seen.earth), "Moon": (_axes_of_moon(seen), seen.moon)},
            stars=seen.R_cam_gcrf,
            directions=self._stars[0],
            magnitudes=self._stars[1],
            credit=CREDIT if len(self._stars[1]) else "",
        )
        return sky.values(stage, open_base(stage)[0])


def _listed(seen: Seen, rows: range, scenario: Scenario, source: str) -> PoseList:
    """Return the poses, named by their `rows` among all epochs; without times if these go back."""
    goes_on = rows.step > 0
    notes = seen.notes if goes_on else (*seen.notes, "the pictures go back in time, so they have no times")
    return PoseList(
        names=tuple(f"img{row + 1:06d}" for row in rows),
        q_cam_body=quaternions_of(seen.R_cam_body),
        t_cam_body=seen.t_cam_body,
        times=seen.seconds if goes_on else None,
        epoch=scenario.utc,
        velocities=seen.velocities if goes_on else None,
        angular_velocities=seen.rates if goes_on else None,
        source=source,
        notes=notes,
    )


def _stars(scenario: Scenario, year: float) -> tuple[Float, Float]:
    if scenario.stars < NO_STARS:
        return np.zeros((0, 3)), np.zeros(0)
    return stars(scenario.stars, year)


def _axes_of_moon(seen: Seen) -> Float:
    """Return the rotations (N, 3, 3) from the Moon's axes: x towards the Earth, z along the ecliptic's pole as near as
    can be. Its libration, 8 degrees, is left out."""
    x = seen.earth - seen.moon
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(seen.R_cam_gcrf @ np.array(ECLIPTIC_POLE), x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], -1)
