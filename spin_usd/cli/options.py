"""The options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from spin_usd.dataset.process.open_renderer import DEFAULT_RENDERER, RENDERERS
from spin_usd.dataset.process.processors import MAX_WORKERS
from spin_usd.dataset.store.stage_path import root_layer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object for programs.")]

STAGE_HELP = "A stage's root layer, or the folder of its dataset.usda."
Stage = Annotated[Path, typer.Argument(help=STAGE_HELP, callback=root_layer)]
Frames = Annotated[
    str | None, typer.Option(metavar="A:B:STEP", help="Some of the frames, counted from 0 as Python slices.")
]
Variants = Annotated[str, typer.Option(metavar="NAME,...", help="Variants, such as noisy_1 or 'noisy_*', or all.")]
Samples = Annotated[int | None, typer.Option(metavar="N", help="Light samples per pixel; 16 by default.")]
EffortText = Annotated[
    str | None, typer.Option("--effort", metavar="TEXT", help="All that it may cost: samples=16,denoiser=fast,...")
]
Quality = Annotated[str | None, typer.Option(metavar="NAME", help="preview, draft, standard or reference.")]
Error = Annotated[
    str | None,
    typer.Option(
        metavar="X",
        help="The cheapest of blender, or of the --renderer given, measured within a relative error, or auto.",
    ),
]
MeasuredIn = Annotated[
    str | None, typer.Option("--measured", metavar="PATH", help="Instead of the measurement beside the stage.")
]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Instead of the stage's own seed.")]
Labels = Annotated[
    str, typer.Option(metavar="NAME,...", help="Labels to write, such as default,range; or all, or none.")
]
LabelsOnly = Annotated[bool, typer.Option("--labels-only", help="No image.")]
RendererName = Annotated[
    str | None,
    typer.Option("--renderer", metavar="NAME", help=f"{' or '.join(RENDERERS)}; {DEFAULT_RENDERER} by default."),
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
        help="Remove all pictures of another stage first: one that author made from other files or with other "
        "options, or that has another root layer's name where author did not make it.",
    ),
]
Verify = Annotated[
    bool, typer.Option("--verify", help="Read what is there before it is used again, and make damaged pictures anew.")
]
ShardText = Annotated[
    str | None,
    typer.Option(
        "--shard",
        metavar="I/N",
        help="Make the pictures of shard I of N alone, I from 0; see docs/clusters.md.",
    ),
]
PictureTimeout = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="Replace a worker that takes longer for a picture; ten times what is expected, and a minute at least, if "
        "not given.",
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
