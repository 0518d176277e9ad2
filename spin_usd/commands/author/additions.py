"""Additions that a user makes to an authored stage: keypoints, names of parts, colour, a LiDAR, and the Sun's place."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from spin_usd.basics.pluralise import pluralise
from spin_usd.basics.resources import bundled
from spin_usd.commands.author.cameras import mounting
from spin_usd.commands.author.model import USD_SUFFIXES
from spin_usd.commands.author.options import AUTO, AuthorOptions
from spin_usd.errors import InputError, SpinError
from spin_usd.formats.lidar_file import read_lidar_file
from spin_usd.formats.table_file import PARTS, read_keypoints_file, read_materials_file, read_parts_file
from spin_usd.scene.event_sensor import PRESETS
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.lidar import Lidar, RangeFinder
from spin_usd.scene.name_rule import MaterialRule, PartRule
from spin_usd.stage.augment.sampled_values import SampledValues, open_base, overlaid, sampled_values
from spin_usd.stage.augment.sun_and_planet import write_sampled
from spin_usd.stage.author.add_parts import add_parts
from spin_usd.stage.author.added_layer import add_keypoints, add_lidar, add_range_finder
from spin_usd.stage.author.camera_layer import layer_name, set_channels, set_event_sensor
from spin_usd.stage.author.target_prim import keep_transparent
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.bodies.keypoints import read_keypoints_layer

NO_MATERIALS: Mapping[str, tuple[str, ...]] = MappingProxyType({})
CHANNELS = ("mono", "rgb")
LIDAR_SUFFIXES = (".toml", ".json")


@dataclass(frozen=True, kw_only=True, eq=False)
class Additions:
    """The additions to one stage. None and empty values change nothing."""

    options: AuthorOptions
    files: Mapping[str, Path]
    """Given files, by their contents."""
    keypoints: Keypoints | None
    parts: tuple[PartRule, ...]
    """Rules, in their order."""
    materials: tuple[MaterialRule, ...]
    """Likewise, of the table of materials."""
    part_materials: tuple[MaterialRule, ...]
    """Rules of the parts file, applied after the table's."""
    lidar: Lidar | None
    range_finder: RangeFinder | None
    sun: Mapping[str, tuple[float, float, float]]
    """By the parameter for its axes, the direction to the Sun: one at most."""

    def write(
        self, root: Path, further: Sequence[str] = (), model_materials: Mapping[str, tuple[str, ...]] = NO_MATERIALS
    ) -> tuple[str, ...]:
        """Write all but the Sun over the stage at `root`, whose `further` cameras have these names; returns notes.
        `model_materials`: as in add_parts. Raises InputError for rules that do not fit the model, OutputError."""
        notes: tuple[str, ...] = ()
        if self.options.keep_transparent:
            keep_transparent(root)
        if self.options.channels is not None:
            for camera in ("", *further):
                set_channels(root.parent / "layers" / layer_name(camera), self.options.channels)
        if self.options.event_sensor is not None:
            for camera in ("", *further):
                set_event_sensor(root.parent / "layers" / layer_name(camera), PRESETS[self.options.event_sensor])
        if self.lidar is not None:
            add_lidar(root, self.lidar, f"The LiDAR in {self.files['lidar'].name}.")
        if self.range_finder is not None:
            add_range_finder(root, self.range_finder, "The laser range finder.")
        if self.keypoints is not None:
            add_keypoints(root, self.keypoints)
            count, file = len(self.keypoints.names), self.files["keypoints"].name
            of = f"1 keypoint is from {file}" if count == 1 else f"{count} keypoints are from {file}"
            notes += (f"{of}, metres in the target's body axes",)
        if self.parts:
            sizes, others = add_parts(root, self.parts, self.files["parts"], model_materials)
            made = ", ".join(f"{name} ({pluralise(count, 'surface')})" for name, count in sizes.items())
            rest = "1 other surface stays unchanged" if others == 1 else f"{others} other surfaces stay unchanged"
            notes += (f"parts made: {made}; {rest}",)
        return notes

    def write_light(self, root: Path, frames: int, light: Callable[[Any], SampledValues] | None) -> None:
        """Write the sampled light of the stage at `root`, which `light` returns for the opened stage, then the
        requested direction of the Sun. Raises InputError for a stage without a Sun."""
        if light is None and not self.sun:
            return
        stage = open_stage(root)
        sampled = light(stage) if light else None
        sun = sampled_values(open_base(stage)[0], self.sun, {}) if self.sun else None
        both = overlaid(sun, sampled) if sun and sampled else sun or sampled
        if both is not None:
            write_sampled(root, both, frames)


def read_additions(options: AuthorOptions) -> Additions:
    """Read the additions that the options describe. Raises InputError."""
    if options.channels is not None and options.channels not in CHANNELS:
        raise InputError(f"there are no channels {options.channels!r}", do=f"choose {' or '.join(CHANNELS)}")
    if options.event_sensor is not None and options.event_sensor not in PRESETS:
        do = f"choose among {', '.join(PRESETS)}, or author SpinEventSensorAPI"
        raise InputError(f"there is no event sensor {options.event_sensor!r}", do=do)
    if options.sun_direction is not None and options.sun_from_target is not None:
        do = "give one: camera axes, or body axes"
        raise InputError("sun_direction and sun_from_target are given together", do=do)
    lidar = None if options.lidar is None else _lidar_file(str(options.lidar))
    materials = None if options.materials == AUTO else options.materials
    files = {"keypoints": options.keypoints, "parts": options.parts, "materials": materials, "lidar": lidar}
    suns = {
        "sun.direction": _direction(options.sun_direction),
        "sun.from_target": _direction(options.sun_from_target),
    }
    return Additions(
        options=options,
        files={what: Path(path) for what, path in files.items() if path is not None},
        keypoints=None if options.keypoints is None else _keypoints(Path(options.keypoints)),
        parts=() if options.parts is None else read_parts_file(options.parts),
        materials=() if materials is None else read_materials_file(materials),
        part_materials=() if options.parts is None else read_materials_file(options.parts, PARTS),
        lidar=None if lidar is None else read_lidar_file(lidar),
        range_finder=None if options.range_finder is None else _range_finder(str(options.range_finder)),
        sun={parameter: direction for parameter, direction in suns.items() if direction is not None},
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
        found = error.found if isinstance(error, SpinError) else f"{degrees!r} is not an angle"
        do = "write DEGREES, or DEGREES:X,Y,Z, for example 0.03:0.1,0,0"
        raise InputError(found, where=f"range_finder {given}", do=do) from None


def _direction(given: str | Sequence[float] | None) -> tuple[float, float, float] | None:
    """Return the direction at unit length. Raises InputError where it has none."""
    if given is None:
        return None
    numbers = [float(each) for each in given]
    length = float(np.linalg.norm(numbers))
    if len(numbers) != 3 or not 0 < length < float("inf"):
        found = f"{', '.join(f'{number:g}' for number in numbers)} is not a direction to the Sun"
        raise InputError(found, do="give three numbers X,Y,Z, not all zero")
    x, y, z = (number / length for number in numbers)
    return x, y, z
