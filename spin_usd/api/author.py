"""A stage from a pose list or sampled poses, a model and a camera."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from spin_usd.api.checked import checked
from spin_usd.dataset.author.reports import AuthorReport
from spin_usd.dataset.process.ask_child import ask_child
from spin_usd.dataset.store.new_folder import nothing_left_of
from spin_usd.errors import InputError
from spin_usd.progress import Progress

AUTHOR_PATIENCE_S = 300.0  # it says no word while it reads a model, which may have millions of faces


@checked
def author(
    *,
    out: str | Path,
    poses: str | Path | None = None,
    sample: str | Path | None = None,
    count: int | None = None,
    target: str | Path | None = None,
    camera: str | Path | None = None,
    units_per_metre: float | None = None,
    prim: str | None = None,
    frames: str | None = None,
    seed: int = 0,
    preset: str | Path | None = None,
    lights: str | Path | None = None,
    environment: str | Path | None = None,
    earth: str | Path | None = None,
    augment: str | Path | None = None,
    keypoints: str | Path | None = None,
    parts: str | Path | None = None,
    channels: str | None = None,
    lidar: str | Path | None = None,
    sun_direction: str | Sequence[float] | None = None,
    sun_from_target: str | Sequence[float] | None = None,
    keep_transparent: bool = False,
    any_size: bool = False,
    root: str | Path | None = None,
    also: str | Sequence[str] = (),
    occluder: str | Sequence[str] = (),
    on_progress: Progress | None = None,
) -> AuthorReport:
    """Make the layered stage `out`/dataset.usda, in a new folder.

    Args:
        out: the folder to make.
        poses: a pose list, or the folder of a data set: SPEED+, SPEED, SHIRT, SPIN, SPARK, CubeSat-CDT, BOP,
            SwissCube, URSO, COCO, YOLO, WebDataset, Croissant or spin_usd's own; then `target` and `camera` are needed
            too.
        sample: instead of it what poses and light are sampled from: text such as "range=3..10 inside=0.9", a TOML file,
            or a name; `target` and `camera` are needed where it names none.
        count: how many pictures are sampled; all if not given.
        target: a target's name, or an OBJ, PLY, STL, glTF, COLLADA, FBX, .blend, STEP or USD file.
        camera: a camera's name, a SPEED+ camera.json, or a camera layer.
        units_per_metre: the model's units in a metre, 100 for centimetres.
        prim: the path of the prim of a USD target that is taken; "/" for all root prims.
        frames: some of the frames, "A:B:STEP" as Python slices.
        seed: the dataset's seed.
        preset: a preset's name, or a preset layer.
        lights: a name, or a lights layer.
        environment: a name, or an environment layer.
        earth: your own map of the Earth, or a folder of them: in latitude and longitude, JPEG, PNG or EXR. A name with
            "cloud" is of the clouds' opacity, one with "night", "light", "black" or "dnb" of lights by night, any other
            of the albedo. Without `environment` it takes `earth`.
        augment: the name of a specification of augmentations to write over the stage, or a TOML file.
        keypoints: a file of named points: JSON, CSV or TOML in metres, body axes; or a USD layer.
        parts: a file of patterns of material and prim names, with part and class; JSON, CSV or TOML.
        channels: "rgb" or "mono", instead of the camera's own.
        lidar: the name of a LiDAR to mount on the camera, or a file of one, TOML or JSON.
        sun_direction: x, y, z of a vector to the Sun in camera axes (x right, y down, z forward); -z is behind;
            numbers, or text with commas between.
        sun_from_target: the same in the target's body axes; the Sun turns with the target.
        keep_transparent: keep surfaces whose material has opacity 0, which no picture shows, in the labels.
        any_size: take a model of any size, even one with the camera inside it.
        root: the folder below which models may name files, such as textures; the one around each model's own if not
            given.
        also: further targets, each a name or a model file, or "MODEL:POSES" with a pose list that has a pose for each
            picture, in their order, before `frames` chooses; without one it moves with the first target, in whose axes
            it is modelled.
        occluder: geometry fixed to the camera, each likewise: modelled in the camera's axes, in metres, or placed there
            by a pose list of one pose, or of one for each picture.
        on_progress: called with what is counted, how many are done and how many there are.

    Raises InputError for what cannot be accepted, StageError and UnsupportedError for a USD target, and OutputError;
    then `out` is not there.
    """
    choices: dict[str, Any] = {
        "target": _text(target),
        "camera": _text(camera),
        "out": str(out),
        "units_per_metre": None if units_per_metre is None else float(units_per_metre),
        "prim": prim,
        "frames": frames,
        "seed": seed,
        "preset": _text(preset),
        "lights": _text(lights),
        "environment": _text(environment),
        "earth": _text(earth),
        "augment": _text(augment),
        "additions": {
            "keypoints": _text(keypoints),
            "parts": _text(parts),
            "channels": channels,
            "lidar": _text(lidar),
            "sun_direction": _numbers("sun_direction", sun_direction),
            "sun_from_target": _numbers("sun_from_target", sun_from_target),
            "keep_transparent": keep_transparent,
        },
        "any_size": any_size,
        "root": _text(root),
        "also": _texts(also),
        "occluders": _texts(occluder),
    }
    call, source = _source(_text(poses), _text(sample), count, choices)
    with nothing_left_of(Path(out)):
        reads = f"{poses or sample} or {target}"
        report = ask_child(call, reads=reads, progress=on_progress, within_s=AUTHOR_PATIENCE_S, **source, **choices)
    return AuthorReport.from_json(report)


def _source(
    poses: str | None, sample: str | None, count: int | None, choices: Mapping[str, Any]
) -> tuple[str, dict[str, Any]]:
    """Return the child's call, and its arguments that say where the pictures come from. Raises InputError."""
    if poses is None and sample is None:
        do = "give a pose list as poses, or say what to sample: sample='range=3..10 inside=0.9 count=100'"
        raise InputError("neither poses nor sample is given", do=do)
    if poses is not None and sample is not None:
        raise InputError("poses and sample are given together", do="give one of them")
    if sample is not None:
        return "author_sample", {"sample": sample, "count": count}
    if count is not None:
        raise InputError("count is given without sample", do="choose poses with frames")
    for name in ("target", "camera"):
        if choices[name] is None:
            raise InputError(f"poses is given without {name}", do=f"give {name} too")
    return "author", {"poses": poses}


def _text(given: str | Path | None) -> str | None:
    return None if given is None else str(given)


def _texts(given: str | Sequence[str]) -> list[str]:
    return [given] if isinstance(given, str) else list(given)


def _numbers(name: str, given: str | Sequence[float] | None) -> list[float] | None:
    """Return the numbers, also those of "X,Y,Z". Raises InputError that names the argument."""
    if given is None:
        return None
    try:
        return [float(each) for each in (given.split(",") if isinstance(given, str) else given)]
    except ValueError:
        raise InputError(f"{name} {given!r} is not X,Y,Z", do="write for example 0.5,-0.7,-0.5") from None
