"""Additions that a user makes to an authored stage: keypoints, names of parts, colour, a LiDAR, and the Sun's place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.commands.author.cameras import mounting
from spin_usd.commands.author.model import USD_SUFFIXES
from spin_usd.errors import InputError, SpinError
from spin_usd.formats.lidar_file import read_lidar_file
from spin_usd.formats.table_file import read_keypoints_file, read_parts_file
from spin_usd.pluralise import pluralise
from spin_usd.resources import bundled
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.lidar import Lidar, RangeFinder
from spin_usd.scene.part_rule import PartRule
from spin_usd.stage.augment.sampled_values import SampledValues, open_base, sampled_values
from spin_usd.stage.author.add_parts import add_parts
from spin_usd.stage.author.added_layer import add_keypoints, add_lidar, add_range_finder
from spin_usd.stage.author.camera_layer import layer_name, set_channels
from spin_usd.stage.author.target_prim import keep_transparent
from spin_usd.stage.read.bodies.keypoints import read_keypoints_layer

CHANNELS = ("mono", "rgb")
LIDAR_SUFFIXES = (".toml", ".json")


@dataclass(frozen=True, kw_only=True, eq=False)
class Additions:
    """The additions to one stage. None and empty leave the stage as it is.

    files: the files that were given, by what they hold · keypoints · parts: rules, in their order · channels: "mono" or
    "rgb" · lidar, range_finder: what is mounted on the camera · sun_from_camera, sun_from_target: directions to the
    Sun, in camera and in body axes, of which one at most is given · keep_transparent: label surfaces of opacity 0 too.
    """

    files: Mapping[str, Path]
    keypoints: Keypoints | None = None
    parts: tuple[PartRule, ...] = ()
    channels: str | None = None
    lidar: Lidar | None = None
    range_finder: RangeFinder | None = None
    sun_from_camera: tuple[float, float, float] | None = None
    sun_from_target: tuple[float, float, float] | None = None
    keep_transparent: bool = False

    def write(self, root: Path, further: Sequence[str] = ()) -> tuple[str, ...]:
        """Write all but the Sun over the stage at `root`, whose `further` cameras have these names; returns notes on
        what was made. Raises InputError for rules that do not fit the model, OutputError."""
        notes: tuple[str, ...] = ()
        if self.keep_transparent:
            keep_transparent(root)
        if self.channels is not None:
            for camera in ("", *further):
                set_channels(root.parent / "layers" / layer_name(camera), self.channels)
        if self.lidar is not None:
            add_lidar(root, self.lidar, f"The LiDAR in {self.files['lidar'].name}.")
        if self.range_finder is not None:
            add_range_finder(root, self.range_finder, "The laser range finder.")
        if self.keypoints is not None:
            add_keypoints(root, self.keypoints)
            count, file = len(self.keypoints.names), self.files["keypoints"].name
            of = f"1 keypoint is that of {file}" if count == 1 else f"{count} keypoints are those of {file}"
            notes += (f"{of}, metres in the target's body axes",)
        if self.parts:
            sizes, others = add_parts(root, self.parts, self.files["parts"])
            made = ", ".join(f"{name} ({pluralise(count, 'surface')})" for name, count in sizes.items())
            rest = "1 other surface stays as it is" if others == 1 else f"{others} other surfaces stay as they are"
            notes += (f"parts made: {made}; {rest}",)
        return notes

    @property
    def turn_sun(self) -> bool:
        """Return whether `sun` gives a direction."""
        return self.sun_from_camera is not None or self.sun_from_target is not None

    def sun(self, stage: Any) -> SampledValues | None:
        """Return the values that turn the Sun of the opened `stage`; None where no direction was asked for. Raises
        InputError for a stage without a Sun."""
        given = {"sun.direction": self.sun_from_camera, "sun.from_target": self.sun_from_target}
        asked = {name: direction for name, direction in given.items() if direction is not None}
        return sampled_values(open_base(stage)[0], asked, {}) if asked else None


def read_additions(
    *,
    keypoints: str | Path | None = None,
    parts: str | Path | None = None,
    channels: str | None = None,
    lidar: str | Path | None = None,
    range_finder: str | float | None = None,
    sun_direction: Sequence[float] | None = None,
    sun_from_target: Sequence[float] | None = None,
    keep_transparent: bool = False,
) -> Additions:
    """Read the additions that these files and values describe. Raises InputError."""
    if channels is not None and channels not in CHANNELS:
        raise InputError(f"there are no channels {channels!r}", do=f"choose {' or '.join(CHANNELS)}")
    if sun_direction is not None and sun_from_target is not None:
        do = "give one: camera axes, or body axes"
        raise InputError("sun_direction and sun_from_target are given together", do=do)
    lidar_file = None if lidar is None else _lidar_file(str(lidar))
    given = {"keypoints": keypoints, "parts": parts, "lidar": lidar_file}
    return Additions(
        files={what: Path(path) for what, path in given.items() if path is not None},
        keypoints=None if keypoints is None else _keypoints(Path(keypoints)),
        parts=() if parts is None else read_parts_file(parts),
        channels=channels,
        lidar=None if lidar_file is None else read_lidar_file(lidar_file),
        range_finder=None if range_finder is None else _range_finder(str(range_finder)),
        sun_from_camera=_direction(sun_direction),
        sun_from_target=_direction(sun_from_target),
        keep_transparent=keep_transparent,
    )


def _keypoints(path: Path) -> Keypoints:
    """Read the keypoints in a table or a USD layer."""
    if path.suffix.lower() not in USD_SUFFIXES:
        return read_keypoints_file(path)
    found = read_keypoints_layer(path)
    if not found.names:
        raise InputError("holds no keypoint", where=path, do="pick some with spin-usd keypoints")
    return found


def _lidar_file(given: str) -> Path:
    """Return the file of the LiDAR of that name, or the file itself."""
    path = Path(given)
    return path if path.suffix.lower() in LIDAR_SUFFIXES else bundled("lidar", given)


def _range_finder(given: str) -> RangeFinder:
    """Return the laser range finder of "DEGREES" or "DEGREES:POSE". Raises InputError."""
    degrees, colon, pose = given.partition(":")
    try:
        T_cam_finder = mounting(pose)[0] if colon else mounting("0,0,0")[0]
        return RangeFinder(T_cam_finder=T_cam_finder, divergence_deg=float(degrees))
    except ValueError as error:
        found = error.found if isinstance(error, SpinError) else f"{degrees!r} is no angle"
        do = "write DEGREES, or DEGREES:X,Y,Z, for example 0.03:0.1,0,0"
        raise InputError(found, where=f"range_finder {given}", do=do) from None


def _direction(given: Sequence[float] | None) -> tuple[float, float, float] | None:
    """Return the direction at unit length. Raises InputError where it has none."""
    if given is None:
        return None
    length = float(np.linalg.norm(given))
    if len(given) != 3 or not 0 < length < float("inf"):
        found = f"{', '.join(f'{number:g}' for number in given)} is not a direction to the Sun"
        raise InputError(found, do="give three numbers X,Y,Z, not all zero")
    x, y, z = (float(number) / length for number in given)
    return x, y, z
