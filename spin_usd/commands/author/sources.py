"""The files that a new stage is made of, opened."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from spin_usd.basics.arrays import digest
from spin_usd.basics.resources import bundled
from spin_usd.commands.author.additions import Additions, read_additions
from spin_usd.commands.author.cameras import open_cameras
from spin_usd.commands.author.model import USD_SUFFIXES, OtherBody, model_file, other_body
from spin_usd.commands.author.options import AUTO, AuthorOptions, listed
from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import pose_files
from spin_usd.files.sha256 import sha256_of
from spin_usd.files.size_limits import MAX_MODEL, MAX_SHARD
from spin_usd.geometry.camera import Camera
from spin_usd.specifications.background_choice import images_in
from spin_usd.specifications.sampling_text import is_sampling_text
from spin_usd.stage.author.camera_layer import lens_of
from spin_usd.stage.author.lights_and_environment import (
    open_surroundings,
    refuse_damaged,
    set_back_plate,
    set_planet_maps,
)
from spin_usd.stage.author.presets import Preset, open_preset
from spin_usd.stage.author.target_root import Option, Origin
from spin_usd.stage.author.write_stage import StageSources

EARTH = "earth"  # the environment that a user's own maps are for, unless another is chosen
BACK_PLATE = "back_plate"  # that for a user's own backgrounds

MAP_WORDS = {"albedo": ("albedo",), "clouds": ("cloud",), "night": ("night", "lights", "black", "dnb")}
"""Kinds of maps, and the words that mark them in file names: the first kind with a word in the name, else the albedo.

Names of maps of night lights refer to NASA's Black Marble, and to the day/night band (DNB) of the instrument."""


def selections(variant: Sequence[str]) -> dict[str, str]:
    """Return variants by their sets of "SET=NAME" each. Raises InputError."""
    found: dict[str, str] = {}
    for each in variant:
        name, _, chosen = each.partition("=")
        if not (name and chosen):
            raise InputError(f"variant {each!r} is not SET=NAME", do="write for example --variant model=full")
        if name in found:
            raise InputError(f"two variants of the set {name!r} are given", do="leave one out")
        found[name] = chosen
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class Sources:
    """The sources of a stage besides its pictures."""

    stage: StageSources
    target_file: Path
    variants: Mapping[str, str]
    """Variants of the target to select, by their sets."""
    others: tuple[OtherBody, ...]
    additions: Additions
    lens: Camera
    """The first camera."""
    camera_file: Path
    camera_notes: tuple[str, ...]
    map_notes: tuple[str, ...]

    @property
    def models(self) -> tuple[Path, ...]:
        """Return the files of all bodies, the target's first."""
        return (self.target_file, *(body.file for body in self.others))


def open_sources(options: AuthorOptions, pictures: Mapping[str, Path]) -> Sources:
    """Open the sources that the options name; `pictures`: the files of the poses. Raises InputError."""
    additions = read_additions(options)
    if not -(2**63) <= options.seed < 2**63:
        raise InputError(f"seed {options.seed} does not fit 64 bits")
    cameras = open_cameras(listed(options.camera), None if options.resolution is None else str(options.resolution))
    target_file = model_file(str(options.target))
    preset = _preset(str(options.preset)) if options.preset is not None else None
    maps = earth_maps(options.earth) if options.earth is not None else {}
    behind = images_in(Path(options.background), "picture") if options.background is not None else []
    layers = _layer_files(options, maps)
    others = (
        *(other_body(each, occluder=False) for each in listed(options.also)),
        *(other_body(each, occluder=True) for each in listed(options.occluder)),
    )
    surroundings = {kind: open_surroundings(file, kind) for kind, file in layers.items()}
    if maps:
        set_planet_maps(surroundings["environment"], maps)
    if behind:
        refuse_damaged(behind)
        set_back_plate(surroundings["environment"], behind, always=options.environment is None)
    files = {
        **pictures,
        "target": target_file,
        **cameras.files,
        **({"preset": preset.file} if preset else {}),
        **{f"earth_{kind}": file for kind, file in maps.items()},
        **{f"background_{number}": file for number, file in enumerate(behind, 1)},
        **layers,
        **additions.files,
        **_files_of(others),
    }
    inputs = {role: (file.name or file.resolve().name, _digest(file)) for role, file in files.items()}
    return Sources(
        stage=StageSources(
            camera=cameras.layer,
            camera_name=cameras.name,
            further=cameras.further,
            preset=preset,
            surroundings=surroundings,
            origin=Origin(inputs=inputs, options=_recorded(options, additions, others)),
            seed=options.seed,
        ),
        target_file=target_file,
        variants=selections(listed(options.variant)),
        others=others,
        additions=additions,
        lens=lens_of(cameras.layer),
        camera_file=cameras.files["camera"],
        camera_notes=cameras.notes,
        map_notes=tuple(f"the Earth's {kind} is from {file.name}" for kind, file in maps.items()),
    )


def _layer_files(options: AuthorOptions, maps: Mapping[str, Path]) -> dict[str, Path]:
    """Return the files of the lights and the environment that are chosen, by kind; with `maps` there is a
    planet, with a background a back plate."""
    usual = EARTH if maps else BACK_PLATE if options.background is not None else None
    environment = usual if options.environment is None else options.environment
    given = {"lights": options.lights, "environment": environment}
    return {kind: _surroundings_file(str(each), kind) for kind, each in given.items() if each is not None}


def _files_of(others: Sequence[OtherBody]) -> dict[str, Path]:
    """Return the files of the other bodies by their roles, such as also_1 and also_1_poses."""
    files: dict[str, Path] = {}
    for kind, occluder in (("also", False), ("occluder", True)):
        for number, body in enumerate((each for each in others if each.occluder == occluder), 1):
            files[f"{kind}_{number}"] = body.file
            if body.poses:
                files[f"{kind}_{number}_poses"] = body.poses
    return files


def _recorded(options: AuthorOptions, additions: Additions, others: Sequence[OtherBody]) -> dict[str, Option]:
    """Return the given values that change pictures besides the files, by the names of `author`'s options and the roles
    of the `others`; targets come first."""
    sample = "" if options.sample is None else str(options.sample)
    resolution = None if options.resolution is None else str(options.resolution)
    recorded = {
        "seed": options.seed,
        "sample": sample if is_sampling_text(sample) else None,
        "units_per_metre": None if options.units_per_metre is None else float(options.units_per_metre),
        "prim": options.prim,
        "model_time": options.model_time,
        "variant": " ".join(listed(options.variant)) or None,
        "leave_out": " ".join(listed(options.leave_out)) or None,
        "materials": AUTO if options.materials == AUTO else None,
        "resolution": resolution,
        "channels": options.channels,
        "sun_direction": additions.sun.get("sun.direction"),
        "sun_from_target": additions.sun.get("sun.from_target"),
        "keep_transparent": options.keep_transparent or None,
        **{f"also_{number}_poses": body.said.text or None for number, body in enumerate(others, 1)},
    }
    return {name: value for name, value in recorded.items() if value is not None}


def _digest(file: Path) -> str:
    """Return the digest of a file, or of the pose lists in a folder."""
    if not file.is_dir():  # a sparse file of a terabyte takes no room on the disk, but an hour to read
        return sha256_of(file, most=MAX_SHARD if file.suffix.lower() == ".tar" else MAX_MODEL)
    return digest([sha256_of(each) for each in pose_files(file)])


def _preset(given: str) -> Preset:
    """Open the preset of that name or in that file."""
    return open_preset(given if Path(given).suffix.lower() in USD_SUFFIXES else bundled("preset", given))


def _surroundings_file(given: str, kind: str) -> Path:
    """Return the layer of the lights or the environment of that name, or the file itself."""
    return Path(given) if Path(given).suffix.lower() in USD_SUFFIXES else bundled(kind, given)


def earth_maps(given: str | Path) -> dict[str, Path]:
    """Return the maps in a folder, or the map in a file, by kind: albedo, clouds, night.

    Raises InputError for a folder without maps or with two of a kind, and for a file that is not a map.
    """
    path = Path(given)
    maps: dict[str, Path] = {}
    for file in images_in(path, "map of the Earth"):
        kind = _kind(file.stem.lower())
        if kind in maps:
            found = f"has two maps of {kind}, {maps[kind].name} and {file.name}"
            raise InputError(found, where=path, do="keep one; names with cloud or night mark these kinds")
        maps[kind] = file
    return maps


def _kind(name: str) -> str:
    return next((kind for kind, words in MAP_WORDS.items() if any(word in name for word in words)), "albedo")
