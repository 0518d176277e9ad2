"""The options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from spin_usd.cli.arguments.completions import listed_in, one_of
from spin_usd.dataset.process.open_renderer import DEFAULT_RENDERER, RENDERERS
from spin_usd.dataset.process.processors import MAX_WORKERS
from spin_usd.dataset.store.stage_path import root_layer
from spin_usd.scene.effort import QUALITIES

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object for programs.")]

STAGE_HELP = "A stage's root layer, or the folder of its dataset.usda."
Stage = Annotated[Path, typer.Argument(help=STAGE_HELP, callback=root_layer)]
Frames = Annotated[
    str | None, typer.Option(metavar="A:B:STEP", help="Some of the frames, counted from 0 as Python slices.")
]
Frame = Annotated[str, typer.Option(metavar="FRAME", help="A frame's name, such as img000001, or its number from 0.")]
Variant = Annotated[str, typer.Option(metavar="NAME", help="The variant of the frame.")]
Variants = Annotated[str, typer.Option(metavar="NAME,...", help="Variants, such as noisy_1 or 'noisy_*', or all.")]
UnitsPerMetre = Annotated[
    float | None, typer.Option(metavar="X", help="The model's units in a metre: 100 for centimetres.")
]
Prim = Annotated[
    str | None, typer.Option(metavar="PATH", help="The prim of a USD target that is taken; / for all root prims.")
]
AnySize = Annotated[
    bool, typer.Option("--any-size", help="Take a model of any size, even one with the camera inside it.")
]
Samples = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="Light samples per pixel instead of the 16 of quality standard; the denoiser stays on."
    ),
]
EffortText = Annotated[
    str | None,
    typer.Option(
        "--effort",
        metavar="NAME=VALUE,...",
        help="Settings of the renderer, such as samples=16,denoiser=fast; "
        "docs/how-to/speed-against-accuracy.md lists them.",
    ),
]
Quality = Annotated[
    str | None,
    typer.Option(
        autocompletion=one_of(QUALITIES),
        metavar="NAME",
        help="Settings by a name: preview, draft, standard (the default) or reference.",
    ),
]
Error = Annotated[
    str | None,
    typer.Option(
        metavar="X",
        help="The cheapest settings whose relative error spin-usd measure found to be X at the most, such as 0.05; "
        "auto for the noise of the stage's own detector.",
    ),
]
MeasuredIn = Annotated[
    str | None,
    typer.Option(
        "--measured",
        metavar="PATH",
        help="For --error: the folder that spin-usd measure wrote; the one beside the stage if not given.",
    ),
]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Seed of all that is random, instead of the stage's own.")]
Labels = Annotated[
    str, typer.Option(metavar="NAME,...", help="Labels to write, such as default,range; or all, or none.")
]
LabelsOnly = Annotated[bool, typer.Option("--labels-only", help="Write labels, and no image.")]
RendererName = Annotated[
    str | None,
    typer.Option(
        "--renderer",
        autocompletion=one_of(RENDERERS),
        metavar="NAME",
        help=f"{' or '.join(RENDERERS)}; {DEFAULT_RENDERER} by default.",
    ),
]
DeviceName = Annotated[
    str,
    typer.Option(
        "--device",
        autocompletion=listed_in("spin_usd.dataset.process.devices", "DEVICES", "auto"),
        metavar="NAME",
        help="What renders the light: cpu, optix, cuda, hip, metal or oneapi; auto for the best that is there.",
    ),
]
RadianceOption = Annotated[bool, typer.Option("--radiance", help="Also write linear radiance as EXR.")]
NoCache = Annotated[
    bool, typer.Option("--no-cache", help="Keep no renders for later runs; changes no byte of a picture.")
]
Prune = Annotated[bool, typer.Option("--prune", help="Remove the dataset's pictures that the stage does not have.")]
Replace = Annotated[
    bool,
    typer.Option(
        "--replace",
        help="Where the dataset was made from another stage, remove all its pictures first; it is refused otherwise.",
    ),
]
Verify = Annotated[
    bool,
    typer.Option(
        "--verify",
        help="First compare every file that is there with its digest, and make damaged pictures again. (check --repair "
        "does so without the stage.)",
    ),
]
ShardText = Annotated[
    str | None,
    typer.Option(
        "--shard",
        metavar="I/N",
        help="Make part I, counted from 0, of a run in N parts; spin-usd merge puts them together. See "
        "docs/how-to/cluster.md.",
    ),
]
PictureTimeout = Annotated[
    str | None,
    typer.Option(
        metavar="SECONDS",
        help="The processor time of the busiest thread for one picture, 1 s to a week: then it is tried once more, "
        "and then reported as failed. If not given, ten times what is expected, and a minute at least.",
    ),
]
ImageFormat = Annotated[str, typer.Option(metavar="NAME", help="png or jpg.")]
Workers = Annotated[
    int | None, typer.Option(metavar="N", min=1, max=MAX_WORKERS, help="Worker processes; as many as fit if not given.")
]
Cluster = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Render on a Ray cluster: auto, HOST:PORT, or ray://HOST:PORT."),
]
