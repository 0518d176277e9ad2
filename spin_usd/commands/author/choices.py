"""The choices that a user makes for a new stage, and the files that it is made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from spin_usd.arrays import digest
from spin_usd.commands.author.additions import Additions
from spin_usd.commands.author.cameras import ChosenCameras, open_cameras
from spin_usd.commands.author.model import USD_SUFFIXES, OtherBody, model_file, other_body
from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import pose_files
from spin_usd.files.size_limits import MAX_MODEL, MAX_SHARD, MAX_TEXTURE
from spin_usd.files.user_file import open_file
from spin_usd.resources import bundled
from spin_usd.sha256 import sha256_of
from spin_usd.stage.author.lights_and_environment import (
    PICTURES,
    open_surroundings,
    refuse_damaged,
    set_back_plate,
    set_planet_maps,
)
from spin_usd.stage.author.presets import Preset, open_preset
from spin_usd.stage.author.target_root import Option, Origin
from spin_usd.stage.usd.layer_file import Layer

EARTH = "earth"  # the environment that a user's own maps are for, unless another is chosen
BACK_PLATE = "back_plate"  # that for a user's own backgrounds

KINDS = {"albedo": ("albedo",), "clouds": ("cloud",), "night": ("night", "lights", "black", "dnb")}
"""What a map shows, and the words for it in files' names: the first kind of which a name holds one, else the albedo.

Maps of lights by night are called after NASA's Black Marble, and the day/night band (DNB) in which they are taken."""


@dataclass(frozen=True, kw_only=True)
class Choices:
    """The choices that a user makes for a new stage, beside its pictures.

    target, preset, lights, environment, augment: names of what travels with spin_usd, or files; the lights and the
    environment replace the preset's · camera: one name or file, or several, each after the first with its pose ·
    resolution: the cameras' pixels, "W" or "WxH", instead of their own · earth: a
    map of the Earth, or a folder of them, for the environment's planet, or that of `earth` where no environment is
    chosen · background: a picture behind everything, or a folder of them, likewise for its back plate · augment: a
    specification to write over the stage · prim: the path of the prim that is taken of a USD target · model_time: the
    seconds after the beginning of the target's animations at which it is taken · variant: SET=NAME, of each a variant
    of the target's root to select
    · sample: the text of a sampling specification that is in no file · additions: what is written over the stage before
    that · any_size: take a target of a size that no craft has, and one inside which the camera is · also, occluders:
    further targets, and what is fixed to the camera, each as `other_body` reads it · root: the folder below which
    models may name files; that around each one's own where it is None.
    """

    target: str | Path
    camera: str | Path | Sequence[str]
    resolution: str | int | None = None
    units_per_metre: float | None = None
    prim: str | None = None
    model_time: float | None = None
    variant: Sequence[str] = ()
    seed: int = 0
    sample: str | None = None
    preset: str | Path | None = None
    lights: str | Path | None = None
    environment: str | Path | None = None
    earth: str | Path | None = None
    background: str | Path | None = None
    augment: str | None = None
    additions: Additions = Additions(files={})  # noqa: RUF009 - frozen
    any_size: bool = False
    also: Sequence[str] = ()
    occluders: Sequence[str] = ()
    root: str | Path | None = None


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


@dataclass(frozen=True, kw_only=True)
class Sources:
    """The files that a stage is made of, opened: its cameras, its target and preset, its surroundings
    with notes on the maps of their planet, and its other bodies."""

    cameras: ChosenCameras
    map_notes: tuple[str, ...]
    target_file: Path
    preset: Preset | None
    surroundings: Mapping[str, Layer]
    others: tuple[OtherBody, ...]
    origin: Origin


def open_sources(choices: Choices, pictures: Mapping[str, Path]) -> Sources:
    """Open what the choices name; `pictures`: the files that the poses come from. Raises InputError."""
    if not -(2**63) <= choices.seed < 2**63:
        raise InputError(f"seed {choices.seed} does not fit 64 bits")
    given = [str(choices.camera)] if isinstance(choices.camera, str | Path) else choices.camera
    cameras = open_cameras(given, None if choices.resolution is None else str(choices.resolution))
    target_file = model_file(str(choices.target))
    preset = _preset(str(choices.preset)) if choices.preset is not None else None
    maps = earth_maps(choices.earth) if choices.earth is not None else {}
    behind = images_in(Path(choices.background), "picture") if choices.background is not None else []
    layers = _layer_files(choices, maps)
    others = (
        *(other_body(each, occluder=False) for each in choices.also),
        *(other_body(each, occluder=True) for each in choices.occluders),
    )
    surroundings = _surroundings(layers, maps)
    if behind:
        refuse_damaged(behind)
        set_back_plate(surroundings["environment"], behind, always=choices.environment is None)
    files = {
        **pictures,
        "target": target_file,
        **cameras.files,
        **({"preset": preset.file} if preset else {}),
        **{f"earth_{kind}": file for kind, file in maps.items()},
        **{f"background_{number}": file for number, file in enumerate(behind, 1)},
        **layers,
        **choices.additions.files,
        **_files_of(others),
    }
    inputs = {role: (file.name or file.resolve().name, _digest(file)) for role, file in files.items()}
    return Sources(
        cameras=cameras,
        map_notes=tuple(f"the Earth's {kind} is that of {file.name}" for kind, file in maps.items()),
        target_file=target_file,
        preset=preset,
        surroundings=surroundings,
        others=others,
        origin=Origin(inputs=inputs, options=_options(choices, others)),
    )


def _layer_files(choices: Choices, maps: Mapping[str, Path]) -> dict[str, Path]:
    """Return the files of the lights and the environment that are chosen, by kind; with `maps` there is a
    planet, with a background a back plate."""
    usual = EARTH if maps else BACK_PLATE if choices.background is not None else None
    environment = usual if choices.environment is None else choices.environment
    given = {"lights": choices.lights, "environment": environment}
    return {kind: _surroundings_file(str(each), kind) for kind, each in given.items() if each is not None}


def _surroundings(layers: Mapping[str, Path], maps: Mapping[str, Path]) -> dict[str, Layer]:
    """Open the layers of the lights and the environment, whose planet shows the `maps`."""
    surroundings = {kind: open_surroundings(file, kind) for kind, file in layers.items()}
    if maps:
        set_planet_maps(surroundings["environment"], maps)
    return surroundings


def _files_of(others: Sequence[OtherBody]) -> dict[str, Path]:
    """Return the files of the other bodies by their roles, such as also_1 and also_1_poses."""
    files: dict[str, Path] = {}
    for kind, occluder in (("also", False), ("occluder", True)):
        for number, body in enumerate((each for each in others if each.occluder == occluder), 1):
            files[f"{kind}_{number}"] = body.file
            if body.poses:
                files[f"{kind}_{number}_poses"] = body.poses
    return files


def _options(choices: Choices, others: Sequence[OtherBody]) -> dict[str, Option]:
    """Return what was given that decides pictures beside the files, by the names of `author`'s options and the roles of
    the `others`, of which targets come first."""
    options = {
        "seed": choices.seed,
        "sample": choices.sample,
        "units_per_metre": choices.units_per_metre,
        "prim": choices.prim,
        "model_time": choices.model_time,
        "variant": " ".join(choices.variant) or None,
        "resolution": None if choices.resolution is None else str(choices.resolution),
        "channels": choices.additions.channels,
        "sun_direction": choices.additions.sun_from_camera,
        "sun_from_target": choices.additions.sun_from_target,
        "keep_transparent": choices.additions.keep_transparent or None,
        **{f"also_{number}_poses": body.said.text or None for number, body in enumerate(others, 1)},
    }
    return {name: value for name, value in options.items() if value is not None}


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
    """Return the maps in a folder, or the map in a file, by what they show: albedo, clouds, night.

    Raises InputError for a folder without maps or with two of a kind, and for a file that is not a map.
    """
    path = Path(given)
    maps: dict[str, Path] = {}
    for file in images_in(path, "map of the Earth"):
        kind = _kind(file.stem.lower())
        if kind in maps:
            found = f"has two maps of {kind}, {maps[kind].name} and {file.name}"
            raise InputError(found, where=path, do="keep one; names with cloud or night say which is which")
        maps[kind] = file
    return maps


def _kind(name: str) -> str:
    return next((kind for kind, words in KINDS.items() if any(word in name for word in words)), "albedo")


def images_in(path: Path, what: str) -> list[Path]:
    """Return the images in the folder `path`, in order, or the image that it is. Raises InputError, which calls them
    `what`, for a folder without any, and for what is none, or cannot be opened."""
    files = [path]
    if path.is_dir():
        listed = (file for file in path.iterdir() if not file.name.startswith("."))  # of macOS: ._a.jpg, no picture
        files = sorted(file for file in listed if file.suffix.lower() in PICTURES)
        if not files:
            raise InputError(f"holds no {what}", where=path, do=f"put {', '.join(PICTURES)} files there")
    elif path.exists() and path.suffix.lower() not in PICTURES:
        do = f"give a folder, or one of {', '.join(PICTURES)}"
        raise InputError(f"is no {what} that is read", where=path, do=do)
    for file in files:
        open_file(file, MAX_TEXTURE).close()  # so that no library opens a pipe, or what fills the memory
    return files
