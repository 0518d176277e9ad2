"""The options of `plan`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Listening, Option, PictureOptions


@dataclass(frozen=True, kw_only=True)
class PlanOptions(Listening, PictureOptions):
    """The pictures that a render would make, and what is to be said of them."""

    out: Annotated[str | Path | None, Option("A dataset: plan what is missing of it.", "PATH")] = None
    events: Annotated[bool, Option("Also say how many time steps and renders the events of an event camera take.")] = (
        False
    )
    explain: Annotated[bool, Option("Also say what work is skipped because no picture needs it, and why.")] = False
