"""The options of `augment`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.completions import bundled, named
from spin_usd.options import Listening, Option, Stage


@dataclass(frozen=True)
class AugmentOptions(Listening):
    """The specification, and the stage to augment."""

    stage: Stage
    _: KW_ONLY
    spec: Annotated[
        str | Path,
        Option(
            f"Specification of the augmentations: a TOML file, or one of {named('specification')}.",
            "NAME_OR_FILE",
            words=bundled("specification"),
            name_or_path=True,
        ),
    ]
    out: Annotated[str | Path | None, Option("Write a new root layer; the stage stays unchanged.", "FILE")] = None
