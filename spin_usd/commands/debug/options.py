"""The options of `debug`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import EffortOptions, Frame, Listening, Option, Seed, Stage, Variant


@dataclass(frozen=True)
class DebugOptions(EffortOptions, Listening):
    """The picture whose scene is written, and its render settings."""

    stage: Stage
    frame: Frame
    _: KW_ONLY
    variant: Variant = "nominal"
    out: Annotated[
        str | Path | None,
        Option("The file to write; FRAME_VARIANT.blend in this folder if not given, FRAME as typed.", "FILE"),
    ] = None
    seed: Seed = None
