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
"""The value of `materials` that recognises them automatically."""


@dataclass(frozen=True, kw_only=True)
class AuthorOptions(Listening):
    """The sources of a stage."""

    out: Annotated[str | Path, Option("Folder to create.", "FOLDER")]
    poses: Annotated[
        str | Path | None,
        Option(
            "A pose list, or the folder of a data set: SPEED+, SPEED, SHIRT, SPIN, SPARK, SPADES, CubeSat-CDT, BOP, "
            "SwissCube, URSO, COCO, YOLO, WebDataset, Croissant, Parquet, nerfstudio, COLMAP or spin_usd's own; a "
            "trajectory as TUM, EuRoC, KITTI or ROS write it; or your own CSV with the columns "
            "name,qw,qx,qy,qz,x,y,z.",
            "PATH",
            also="It needs `target` and `camera` too.",
        ),
    ] = None
    sample: Annotated[
        str | Path | None,
        Option(
            "Sample poses and light with the seed, instead of reading --poses: text such as 'range=3..10 inside=0.9', "
            f"a TOML file, or a name ({named('sample')}). --target, --camera, --preset, --lights and --environment "
            "replace its own.",
            "TEXT_OR_NAME_OR_FILE",
            words=bundled("sample"),
            name_or_path=True,
        ),
    ] = None
    scenario: Annotated[
        str | Path | None,
        Option(
            "Two spacecraft in Earth orbit at given times, instead of --poses: a TOML file with their orbits and "
            f"attitudes, or a name ({named('scenario')}). Sun, Earth, Moon and stars are placed by the time. Needs "
            "the extra [orbit].",
            "NAME_OR_FILE",
            words=bundled("scenario"),
            name_or_path=True,
        ),
    ] = None
    count: Annotated[int | None, Option("Number of pictures to sample; all if not given.", "N")] = None
    target: Annotated[
        str | Path | None,
        Option(
            f"{named('target')}; an OBJ, PLY, STL, glTF, COLLADA, FBX, .blend, STEP or USD file; craft:SEED or a "
            "craft.toml, for a craft that is made from it.",
            NAME_OR_FILE,
            words=bundled("target"),
            name_or_path=True,
        ),
    ] = None
    camera: Annotated[
        str | Path | Sequence[str | Path],
        Option(
            f"{named('camera')}; a SPEED+ camera.json, a calibration of OpenCV, ROS, Kalibr, COLMAP or "
            "nerfstudio, or a camera layer. Repeat it for each further camera, which "
            "also takes a picture of each frame, with its pose in the axes of the first: X,Y,Z, QW,QX,QY,QZ,X,Y,Z or a "
            "pose list of one pose. NAME=FILE names a camera; otherwise the file's name does.",
            "NAME_OR_FILE[:POSE]",
            words=bundled("camera"),
            name_or_path=True,
            repeated=True,
        ),
    ] = ()
    resolution: Annotated[
        str | int | None,
        Option(
            "Size of the pictures in pixels, W or WxH, instead of the cameras' own. The field of view stays the same; "
            "K and lens are scaled.",
            "W[xH]",
        ),
    ] = None
    units_per_metre: UnitsPerMetre = None
    prim: Prim = None
    model_time: Annotated[
        float | None,
        Option(
            "Show the target this long after its animations begin (glTF, FBX, .blend), not in its stored rest state.",
            "SECONDS",
        ),
    ] = None
    variant: Annotated[
        str | Sequence[str],
        Option("A variant of the USD target; repeat it for each variant set.", "SET=NAME", repeated=True),
    ] = ()
    leave_out: Annotated[
        str | Sequence[str],
        Option("Leave out the target's prims whose names match; repeat it for each.", "PATTERN", repeated=True),
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
            "Your own map of the Earth in latitude and longitude, or a folder of maps: JPEG, PNG or EXR. A name with "
            "cloud or night marks that map; any other is the albedo. The default of --environment is then earth.",
            "PATH",
        ),
    ] = None
    background: Annotated[
        str | Path | None,
        Option(
            "Your own background image, or a folder of images, one of which is chosen at random for each picture: "
            "JPEG, PNG or EXR. The default of --environment is then back_plate, upright in every picture. The image is "
            "exposed like the scene: its white is as bright as white ground in sunlight, not full scale.",
            "PATH",
        ),
    ] = None
    augment: Annotated[
        str | Path | None,
        Option(
            f"A specification of augmentations for the stage: {named('specification')}, or a TOML file.",
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
            "Patterns of material and prim names -> a material of spin-usd list materials, its color and scale: JSON, "
            "CSV or TOML; or auto, which recognises materials by names and colours, and also writes the table.",
            "FILE_OR_auto",
            words=lambda incomplete: (AUTO,),
            name_or_path=True,
        ),
    ] = None
    also: Annotated[
        str | Sequence[str],
        Option(
            "One more target, a name or a model file; repeat it for each. POSES is a list with a pose for each "
            "picture, before --frames selects; or text to sample from, such as 'distance=1..5 count=3' (metres from "
            "the first target) or 'range=3..9 inside=1', without collisions; or attached: modelled in the axes of the "
            "first target, and moving with it. Without POSES it is sampled like the target of --sample, or attached to "
            "the target of --poses.",
            "MODEL[:POSES]",
            repeated=True,
        ),
    ] = ()
    occluder: Annotated[
        str | Sequence[str],
        Option(
            "Geometry fixed to the camera, such as an arm; repeat it for each. It is modelled in the camera's axes (x "
            "right, y down, z forward; metres), or placed there by a pose list with one pose or one for each picture.",
            "MODEL[:POSES]",
            repeated=True,
        ),
    ] = ()
    channels: Annotated[str | None, Option("rgb or mono, instead of the camera's own.", "NAME")] = None
    event_sensor: Annotated[
        str | None,
        Option(f"Make the camera an event camera too, with pixels of the type {', '.join(EVENT_SENSORS)}.", "NAME"),
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
            "A laser range finder along the camera's axis: its divergence, the full angle in degrees, and optionally "
            "its pose in the camera's axes, as in --camera. Records contain the range at its boresight.",
            "DEGREES[:POSE]",
        ),
    ] = None
    sun_direction: Annotated[
        str | Sequence[float] | None,
        Option("Direction to the Sun in camera axes: x right, y down, z forward; -z is behind.", "X,Y,Z"),
    ] = None
    sun_from_target: Annotated[
        str | Sequence[float] | None,
        Option("Direction to the Sun in the target's body axes; the Sun turns with the target.", "X,Y,Z"),
    ] = None
    keep_transparent: Annotated[bool, Option("Keep surfaces of opacity 0, which no picture shows, in the labels.")] = (
        False
    )
    any_size: AnySize = False
    root: Annotated[
        str | Path | None,
        Option(
            "The folder from which models may load files, such as textures; the parent of each model's own folder if "
            "not given.",
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
    """Return the numbers of a sequence or of "X,Y,Z". Raises InputError that names the option."""
    if given is None:
        return None
    try:
        return [float(each) for each in (given.split(",") if isinstance(given, str) else given)]
    except ValueError:
        raise InputError(f"{name} {given!r} is not X,Y,Z", do="write for example 0.5,-0.7,-0.5") from None
