"""What a run would make: every picture with its keys. Runs in a child process, for it opens the stage."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from spin_usd.dataset.job import PlannedPicture
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.formats import image_file
from spin_usd.formats.pose_list import slice_of
from spin_usd.scene.keys import RenderSettings, exposure_key, geometry_key, radiance_key
from spin_usd.scene.model import Scene
from spin_usd.stage import schema
from spin_usd.stage.copies import copy_stage
from spin_usd.stage.read import StageReader

PROGRESS_EVERY = 500


def make_plan(
    *,
    stage: str,
    variants: Sequence[str],
    frames: str | None,
    renderer: str,
    samples: int,
    seed: int | None,
    image_suffix: str | None,
    copy_to: str | None = None,
    progress: Callable[[Any], None],
) -> dict[str, Any]:
    """The plan of a run over `stage` as JSON: settings, the stage's provenance by variant, and the pictures.

    `variants` empty means nominal alone, ["all"] all of them. `copy_to`: first copy the stage into that folder and
    plan from the copy, whose root layer is returned as "root". `image_suffix`: of the image files, None for none.
    Raises UnsupportedError where they cannot hold what a sensor gives.
    """
    root = copy_stage(Path(stage), Path(copy_to)) if copy_to else Path(stage)
    first = StageReader(root)
    wanted = _wanted_variants(variants, first.variants)
    settings = RenderSettings(renderer=renderer, samples=samples, seed=first.seed if seed is None else seed)
    chosen = range(len(first.frames))[slice_of(frames)] if frames else range(len(first.frames))
    if not chosen:
        raise InputError(f"--frames {frames} selects none of the {len(first.frames)} pictures", where=stage)
    pictures: list[dict[str, Any]] = []
    stages: dict[str, dict[str, Any]] = {}
    for variant in wanted:
        reader = first if variant == first.variant else StageReader(root, variant=variant)
        stages[variant] = stage_provenance(reader)
        for index in chosen:
            pictures.append(asdict(_planned(reader, index, settings, image_suffix)))
            if len(pictures) % PROGRESS_EVERY == 0:
                progress([len(pictures), len(wanted) * len(chosen)])
    return {
        "root": str(root),
        "settings": asdict(settings),
        "variants": wanted,
        "known_variants": list(first.variants),
        "stages": stages,
        "names": [frame.name for frame in first.frames],
        "description": _description(first),
        "pictures": pictures,
    }


def stage_provenance(reader: StageReader) -> dict[str, Any]:
    """What a record says of the stage that made its picture, but its place."""
    return {"hash": reader.stage_hash, "files": reader.used_files, "variants": reader.variant_selections}


def _wanted_variants(asked: Sequence[str], known: Sequence[str]) -> list[str]:
    if list(asked) == ["all"]:
        return list(known)
    for variant in asked:
        if variant not in known:
            raise InputError(f"the stage has no variant {variant!r}", do=f"choose among {', '.join(known)}, or all")
    return list(dict.fromkeys(asked)) or [known[0]]


def _planned(reader: StageReader, index: int, settings: RenderSettings, image_suffix: str | None) -> PlannedPicture:
    frame = reader.frames[index]
    scene = reader.scene(frame)
    if image_suffix:
        _check_bit_depth(reader, scene, image_suffix)
    region = scene.picture_region
    return PlannedPicture(
        variant=reader.variant,
        index=index,
        frame=frame.name,
        time_code=frame.time_code,
        geometry=geometry_key(scene, settings.renderer),
        radiance=radiance_key(scene, settings),
        exposure=exposure_key(scene, settings),
        region=(region.x0, region.y0, region.x1, region.y1),
    )


def _check_bit_depth(reader: StageReader, scene: Scene, image_suffix: str) -> None:
    """Raise UnsupportedError where image files of that kind cannot hold the sensor's numbers."""
    bits = scene.sensor.bit_depth
    if f"uint{bits}" not in image_file.KINDS[image_suffix]:
        found = f"is {bits}, which {image_suffix} files cannot hold (picture {reader.variant}/{scene.frame.name})"
        do = "choose --image-format png, or make it 8"
        raise UnsupportedError(found, where=f"{reader.camera_path}.{schema.SENSOR['bit_depth']}", do=do)


def _description(reader: StageReader) -> dict[str, Any]:
    """What dataset.json says of the target."""
    scene = reader.scene(reader.frames[0])
    target = scene.target
    return {
        "target": target.name,
        "parts": {str(p.id): {"path": p.path, "class": p.class_name, "name": p.name} for p in target.parts},
        "keypoints": {
            name: point.tolist() for name, point in zip(target.keypoint_names, target.keypoints, strict=True)
        },
        "camera": [scene.camera.width, scene.camera.height],
        "channels": scene.sensor.channels,
    }
