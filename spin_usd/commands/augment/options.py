"""The options of `augment`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.completions import bundled, named
from spin_usd.options import Listening, Option, Stage


@dataclass(frozen=True)
class AugmentOptions(Listening):
    """What is written over which stage."""

    stage: Stage
    _: KW_ONLY
    spec: Annotated[
        str | Path,
        Option(
            f"What to write: a TOML file, or one of {named('specification')}.",
            "NAME_OR_FILE",
            words=bundled("specification"),
            name_or_path=True,
        ),
    ]
    out: Annotated[str | Path | None, Option("A new root layer beside the stage, which stays as it is.", "FILE")] = None
