"""`spin-usd keypoints`: picks the keypoints of a target in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from spin_usd.cli.arguments.built_in import named
from spin_usd.cli.arguments.completions import bundled
from spin_usd.cli.arguments.options import AnySize, Prim, UnitsPerMetre
from spin_usd.cli.output.lines import show, tell
from spin_usd.counted import counted
from spin_usd.dataset.keypoints.request import PORT, KeypointsRequest
from spin_usd.dataset.serve.own_page import LOCAL


def keypoints(
    target: Annotated[
        str,
        typer.Argument(
            autocompletion=bundled("target"),
            metavar="NAME_OR_FILE",
            help=f"{named('target')}; an OBJ, PLY, STL, glTF, COLLADA, FBX, .blend, STEP or USD file, as of author.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The USD layer (.usda) to save in at every change, and to go on with where it is there; "
            "NAME_keypoints.usda if not given.",
        ),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(metavar="DATASET", help="A dataset of the target: the keypoints are drawn into its pictures."),
    ] = None,
    units_per_metre: UnitsPerMetre = None,
    prim: Prim = None,
    any_size: AnySize = False,
    host: Annotated[
        str,
        typer.Option(metavar="ADDRESS", help="Where to listen. Any other than 127.0.0.1 lets others change keypoints."),
    ] = LOCAL,
    port: Annotated[int, typer.Option(metavar="N", help="The port to listen on; 0 for any that is free.")] = PORT,
) -> None:
    """Pick the keypoints of a target in the browser: click on it, name, move, copy. Saves a layer that author reads."""
    from spin_usd.dataset.keypoints.keypoints import pick_keypoints

    request = KeypointsRequest(
        target=target,
        out=out,
        pictures=pictures,
        units_per_metre=units_per_metre,
        prim=prim,
        any_size=any_size,
        host=host,
        port=port,
    )
    if not request.is_local:
        tell(f"warning: whoever reaches {host} over a network can see the target and change its keypoints")
    session = pick_keypoints(request, tell=tell)
    show(f"{session.saved_in}   ({counted(len(session.keypoints.names), 'keypoint')})")
