"""The options of `author`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.completions import bundled, named
from spin_usd.errors import InputError
from spin_usd.options import AnySize, Frames, Listening, Option, Prim, UnitsPerMetre
from spin_usd.scene.event_sensor import PRESETS as EVENT_SENSORS

NAME_OR_FILE = "NAME_OR_FILE"
AUTO = "auto"
"""The value of `materials` by which they are recognised."""


@dataclass(frozen=True, kw_only=True)
class AuthorOptions(Listening):
    """What a stage is made of."""

    out: Annotated[str | Path, Option("Folder to make.", "FOLDER")]
    poses: Annotated[
        str | Path | None,
        Option(
            "A pose list, or the folder of a data set: SPEED+, SPEED, SHIRT, SPIN, SPARK, SPADES, CubeSat-CDT, BOP, "
            "SwissCube, URSO, COCO, YOLO, WebDataset, Croissant, Parquet, nerfstudio, COLMAP or spin_usd's own; or "
            "your own CSV with the columns name,qw,qx,qy,qz,x,y,z.",
            "PATH",
            also="Then `target` and `camera` are needed too.",
        ),
    ] = None
    sample: Annotated[
        str | Path | None,
        Option(
            "What poses and light are sampled from, by the seed, instead of reading --poses: text such as "
            f"'range=3..10 inside=0.9', a TOML file, or a name ({named('sample')}); --target, --camera, --preset, "
            "--lights and --environment stand in place of its own.",
            "TEXT_OR_NAME_OR_FILE",
            words=bundled("sample"),
            name_or_path=True,
        ),
    ] = None
    scenario: Annotated[
        str | Path | None,
        Option(
            "Two craft about the Earth at given times, instead of --poses: their orbits and attitudes in a TOML file, "
            f"or a name ({named('scenario')}). Sun, Earth, Moon and stars stand where they are then. Needs the extra "
            "[orbit].",
            "NAME_OR_FILE",
            words=bundled("scenario"),
            name_or_path=True,
        ),
    ] = None
    count: Annotated[int | None, Option("Pictures to sample; all if not given.", "N")] = None
    target: Annotated[
        str | Path | None,
        Option(
            f"{named('target')}; an OBJ, PLY, STL, glTF, COLLADA, FBX, .blend, STEP or USD file.",
            NAME_OR_FILE,
            words=bundled("target"),
            name_or_path=True,
        ),
    ] = None
    camera: Annotated[
        str | Path | Sequence[str | Path],
        Option(
            f"{named('camera')}; a SPEED+ camera.json, or a camera layer. Again for each further camera, which takes a "
            "picture of each frame too, with its place in the first one's axes: X,Y,Z, QW,QX,QY,QZ,X,Y,Z or a pose "
            "list of one pose. Its name is its file's, or NAME=FILE gives one.",
            "NAME_OR_FILE[:POSE]",
            words=bundled("camera"),
            name_or_path=True,
            repeated=True,
        ),
    ] = ()
    resolution: Annotated[
        str | int | None,
        Option(
            "The cameras' pixels, instead of their own, W or WxH: they see the same by larger or smaller pixels, "
            "their K and lens with them.",
            "W[xH]",
        ),
    ] = None
    units_per_metre: UnitsPerMetre = None
    prim: Prim = None
    model_time: Annotated[
        float | None,
        Option(
            "Show the target so long after its animations begin (glTF, FBX, .blend), not as it is stored without them.",
            "SECONDS",
        ),
    ] = None
    variant: Annotated[
        str | Sequence[str],
        Option("A variant of the USD target to show, again for each variant set.", "SET=NAME", repeated=True),
    ] = ()
    frames: Frames = None
    seed: Annotated[int, Option("The dataset's seed.", "N")] = 0
    preset: Annotated[
        str | Path | None,
        Option(f"{named('preset')}, or a preset layer.", NAME_OR_FILE, words=bundled("preset"), name_or_path=True),
    ] = None
    lights: Annotated[
        str | Path | None,
        Option(f"{named('lights')}, or a lights layer.", NAME_OR_FILE, words=bundled("lights"), name_or_path=True),
    ] = None
    environment: Annotated[
        str | Path | None,
        Option(
            f"{named('environment')}, or an environment layer.",
            NAME_OR_FILE,
            words=bundled("environment"),
            name_or_path=True,
        ),
    ] = None
    earth: Annotated[
        str | Path | None,
        Option(
            "Your own map of the Earth, or a folder of them: latitude and longitude; JPEG, PNG or EXR. Names with "
            "cloud or night say which is which, any other is the albedo. Without --environment it takes earth.",
            "PATH",
        ),
    ] = None
    background: Annotated[
        str | Path | None,
        Option(
            "Your own picture behind everything, or a folder of them, of which chance takes one for each picture: "
            "JPEG, PNG or EXR. Without --environment it takes back_plate, upright in every picture. It is "
            "exposed like all else: white is as bright as white ground in the Sun, not full scale.",
            "PATH",
        ),
    ] = None
    augment: Annotated[
        str | Path | None,
        Option(
            f"A specification of augmentations to write over it: {named('specification')}, or a TOML file.",
            NAME_OR_FILE,
            words=bundled("specification"),
            name_or_path=True,
        ),
    ] = None
    keypoints: Annotated[
        str | Path | None,
        Option("Named points: JSON, CSV or TOML in metres, body axes; or a USD layer.", "FILE"),
    ] = None
    parts: Annotated[
        str | Path | None,
        Option("Patterns of material and prim names -> part and class: JSON, CSV or TOML.", "FILE"),
    ] = None
    materials: Annotated[
        str | Path | None,
        Option(
            "Patterns of material and prim names -> material of spin-usd list materials, its color and scale: JSON, "
            "CSV or TOML; or auto: by what they are called and by their colours, which also writes the table.",
            "FILE_OR_auto",
            words=lambda incomplete: (AUTO,),
            name_or_path=True,
        ),
    ] = None
    also: Annotated[
        str | Sequence[str],
        Option(
            "One more target, again for each: a name or a model file. POSES: a list with a pose for each picture, "
            "before --frames chooses; or text to sample them from, such as 'distance=1..5 count=3' (metres from the "
            "first target) or 'range=3..9 inside=1', where no two collide; or attached, which moves with the first "
            "target, in whose axes it is modelled. Without POSES it is sampled like the target of --sample, and is "
            "attached to that of --poses.",
            "MODEL[:POSES]",
            repeated=True,
        ),
    ] = ()
    occluder: Annotated[
        str | Sequence[str],
        Option(
            "Geometry fixed to the camera, such as an arm, again for each: modelled in the camera's axes (x right, y "
            "down, z forward; metres), or placed there by a pose list of one pose or one for each picture.",
            "MODEL[:POSES]",
            repeated=True,
        ),
    ] = ()
    channels: Annotated[str | None, Option("rgb or mono, instead of the camera's own.", "NAME")] = None
    event_sensor: Annotated[
        str | None,
        Option(f"Make it an event camera too, with pixels such as those of {', '.join(EVENT_SENSORS)}.", "NAME"),
    ] = None
    lidar: Annotated[
        str | Path | None,
        Option(
            f"A LiDAR on the camera: {named('lidar')}, or a TOML or JSON file.",
            NAME_OR_FILE,
            words=bundled("lidar"),
            name_or_path=True,
        ),
    ] = None
    range_finder: Annotated[
        str | float | None,
        Option(
            "A laser range finder along the camera's axis: its divergence, the full angle in degrees, and perhaps its "
            "place in the camera's axes as --camera has it. Records say the range at its boresight.",
            "DEGREES[:POSE]",
        ),
    ] = None
    sun_direction: Annotated[
        str | Sequence[float] | None,
        Option("To the Sun, in camera axes: x right, y down, z forward; -z is behind.", "X,Y,Z"),
    ] = None
    sun_from_target: Annotated[
        str | Sequence[float] | None,
        Option("To the Sun, in the target's body axes: it turns with the target.", "X,Y,Z"),
    ] = None
    keep_transparent: Annotated[bool, Option("Keep surfaces of opacity 0, which no picture shows, in the labels.")] = (
        False
    )
    any_size: AnySize = False
    root: Annotated[
        str | Path | None,
        Option(
            "The folder below which models may name files, such as textures. If not given, the one around each model's "
            "own.",
            "FOLDER",
            name_or_path=True,
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("sun_direction", "sun_from_target"):
            object.__setattr__(self, name, _numbers(name, getattr(self, name)))


def listed(given: str | Path | Sequence[str | Path]) -> list[str]:
    """Return the values of an option that may be given several times."""
    return [str(given)] if isinstance(given, str | Path) else [str(each) for each in given]


def _numbers(name: str, given: str | Sequence[float] | None) -> list[float] | None:
    """Return the numbers, also those of "X,Y,Z". Raises InputError that names the option."""
    if given is None:
        return None
    try:
        return [float(each) for each in (given.split(",") if isinstance(given, str) else given)]
    except ValueError:
        raise InputError(f"{name} {given!r} is not X,Y,Z", do="write for example 0.5,-0.7,-0.5") from None
