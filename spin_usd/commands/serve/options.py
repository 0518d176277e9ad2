"""The options of `serve`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import EffortOptions, Option, RendererName, Seed, Stage, Variant

PORT = 8644


@dataclass(frozen=True)
class ServeOptions(EffortOptions):
    """The stage that is served, where, and how its pictures are made."""

    stage: Stage
    _: KW_ONLY
    at: Annotated[
        str | None,
        Option(
            f"Where it listens, tcp://127.0.0.1:{PORT} if not given: tcp://ADDRESS:PORT, or ipc://FILE for a socket in "
            "the file system. Other machines get in by an address of this one that they reach, and nobody is asked who "
            "they are.",
            "ADDRESS",
        ),
    ] = None
    log: Annotated[
        str | Path | None,
        Option("A folder for the stage of all that was asked for, which render makes again.", "FOLDER"),
    ] = None
    parts: Annotated[
        str | Sequence[str],
        Option("Parts of the first target that clients may move, where there is a log.", "NAME,..."),
    ] = ()
    variant: Variant = "nominal"
    renderer: RendererName = None
    seed: Seed = None
