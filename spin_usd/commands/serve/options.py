"""The options of `serve`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import EffortOptions, Option, RendererName, Seed, Stage, Variant

PORT = 8644


@dataclass(frozen=True)
class ServeOptions(EffortOptions):
    """The stage to serve, the address, and the settings of the pictures."""

    stage: Stage
    _: KW_ONLY
    at: Annotated[
        str | None,
        Option(
            f"Address to listen on, tcp://127.0.0.1:{PORT} if not given: tcp://ADDRESS:PORT, or ipc://FILE for a "
            "socket file. To accept other machines, listen on an address they can reach. There is no authentication.",
            "ADDRESS",
        ),
    ] = None
    log: Annotated[
        str | Path | None,
        Option("Folder of a stage that logs every request, for render to make the pictures again.", "FOLDER"),
    ] = None
    parts: Annotated[
        str | Sequence[str],
        Option("With --log: the parts of the first target that clients may move.", "NAME,..."),
    ] = ()
    variant: Variant = "nominal"
    renderer: RendererName = None
    seed: Seed = None
