"""`spin-usd author`: writes a stage from a pose list, from sampled poses, or as one page."""

import json
from pathlib import Path
from typing import Annotated

import typer

import spin_usd
from spin_usd.cli.arguments.built_in import named
from spin_usd.cli.arguments.completions import bundled
from spin_usd.cli.arguments.options import AnySize, Frames, Json, Prim, UnitsPerMetre
from spin_usd.cli.output.lines import show
from spin_usd.cli.output.notes import show_notes
from spin_usd.cli.output.progress import shown
from spin_usd.counted import counted
from spin_usd.errors import InputError


def author(
    context: typer.Context,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Folder to make.")],
    poses: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="A pose list, or the folder of a data set: SPEED+, SPEED, SHIRT, SPIN, SPARK, CubeSat-CDT, BOP, "
            "SwissCube, URSO, COCO, YOLO, WebDataset, Croissant or spin_usd's own.",
        ),
    ] = None,
    sample: Annotated[
        str | None,
        typer.Option(
            autocompletion=bundled("sample"),
            metavar="TEXT_OR_NAME_OR_FILE",
            help="What poses and light are sampled from, by the seed, instead of reading --poses: text such as "
            f"'range=3..10 inside=0.9', a TOML file, or a name ({named('sample')}); --target, --camera, --preset, "
            "--lights and --environment stand in place of its own.",
        ),
    ] = None,
    count: Annotated[int | None, typer.Option(metavar="N", help="Pictures to sample; all if not given.")] = None,
    target: Annotated[
        str | None,
        typer.Option(
            autocompletion=bundled("target"),
            metavar="NAME_OR_FILE",
            help=f"{named('target')}; an OBJ, PLY, STL, glTF, COLLADA, FBX, .blend, STEP or USD file.",
        ),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            autocompletion=bundled("camera"),
            metavar="NAME_OR_FILE",
            help=f"{named('camera')}; a SPEED+ camera.json, or a camera layer.",
        ),
    ] = None,
    units_per_metre: UnitsPerMetre = None,
    prim: Prim = None,
    frames: Frames = None,
    seed: Annotated[int, typer.Option(metavar="N", help="The dataset's seed.")] = 0,
    preset: Annotated[
        str | None,
        typer.Option(
            autocompletion=bundled("preset"), metavar="NAME_OR_FILE", help=f"{named('preset')}, or a preset layer."
        ),
    ] = None,
    lights: Annotated[
        str | None,
        typer.Option(
            autocompletion=bundled("lights"), metavar="NAME_OR_FILE", help=f"{named('lights')}, or a lights layer."
        ),
    ] = None,
    environment: Annotated[
        str | None,
        typer.Option(
            autocompletion=bundled("environment"),
            metavar="NAME_OR_FILE",
            help=f"{named('environment')}, or an environment layer.",
        ),
    ] = None,
    earth: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="Your own map of the Earth, or a folder of them: latitude and longitude; JPEG, PNG or EXR. Names with "
            "cloud or night say which is which, any other is the albedo. Without --environment it takes earth.",
        ),
    ] = None,
    augment: Annotated[
        str | None,
        typer.Option(
            autocompletion=bundled("specification"),
            metavar="NAME_OR_FILE",
            help=f"A specification of augmentations to write over it: {named('specification')}, or a TOML file.",
        ),
    ] = None,
    keypoints: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Named points: JSON, CSV or TOML in metres, body axes; or a USD layer."),
    ] = None,
    parts: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Patterns of material and prim names -> part and class: JSON, CSV or TOML."),
    ] = None,
    also: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MODEL[:POSES]",
            help="One more target, again for each: a name or a model file, and a pose list with a pose for each "
            "picture, before --frames chooses; without one it moves with the first target, in whose axes it is "
            "modelled.",
        ),
    ] = None,
    occluder: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MODEL[:POSES]",
            help="Geometry fixed to the camera, such as an arm, again for each: modelled in the camera's axes (x "
            "right, y down, z forward; metres), or placed there by a pose list of one pose or one for each picture.",
        ),
    ] = None,
    channels: Annotated[
        str | None, typer.Option(metavar="NAME", help="rgb or mono, instead of the camera's own.")
    ] = None,
    lidar: Annotated[
        str | None,
        typer.Option(
            autocompletion=bundled("lidar"),
            metavar="NAME_OR_FILE",
            help=f"A LiDAR on the camera: {named('lidar')}, or a TOML or JSON file.",
        ),
    ] = None,
    sun_direction: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="To the Sun, in camera axes: x right, y down, z forward; -z is behind."),
    ] = None,
    sun_from_target: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="To the Sun, in the target's body axes: it turns with the target."),
    ] = None,
    keep_transparent: Annotated[
        bool,
        typer.Option("--keep-transparent", help="Keep surfaces of opacity 0, which no picture shows, in the labels."),
    ] = False,
    any_size: AnySize = False,
    root: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="The folder below which models may name files, such as textures. If not given, the one around each "
            "model's own.",
        ),
    ] = None,
    minimal: Annotated[
        bool, typer.Option("--minimal", help="Write a stage of one page, with all it needs, to be edited by hand.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Make a layered stage OUT/dataset.usda from a pose list or sampled poses, a model and a camera."""
    from spin_usd.scene.derived.view_text import summary

    if minimal:
        _write_minimal(context, out, as_json)
        return
    with shown(context.obj["quiet"]) as progress:
        report = spin_usd.author(
            out=out,
            poses=poses,
            sample=sample,
            count=count,
            target=target,
            camera=camera,
            units_per_metre=units_per_metre,
            prim=prim,
            frames=frames,
            seed=seed,
            preset=preset,
            lights=lights,
            environment=environment,
            earth=earth,
            augment=augment,
            keypoints=keypoints,
            parts=parts,
            channels=channels,
            lidar=lidar,
            sun_direction=sun_direction,
            sun_from_target=sun_from_target,
            keep_transparent=keep_transparent,
            any_size=any_size,
            root=root,
            also=also or (),
            occluder=occluder or (),
            on_progress=progress,
        )
    if as_json:
        show(json.dumps(report.as_json()))
        return
    show_notes(report.notes)
    show(f"{report.root}   ({counted(report.frames, 'frame')})")
    show(*summary(report.views).split("\n"))


def _write_minimal(context: typer.Context, out: Path, as_json: bool) -> None:
    """Write the stage of one page into `out`. Raises InputError for options that are given besides."""
    from spin_usd.dataset.author.minimal import write_minimal

    sources = {name: context.get_parameter_source(name) for name in context.params}
    asked = [name for name, source in sources.items() if source and source.name == "COMMANDLINE"]
    if given := [name for name in asked if name not in ("out", "minimal", "as_json")]:
        names = " and ".join(f"--{name.replace('_', '-')}" for name in given)
        raise InputError(f"{names} is given with --minimal, which asks for nothing but --out", do="drop one of them")
    root = write_minimal(out)
    show(json.dumps({"root": str(root)}) if as_json else f"{root}   (one page: edit it, then check and render it)")
