"""The options of `plan`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Listening, Option, PictureOptions


@dataclass(frozen=True, kw_only=True)
class PlanOptions(Listening, PictureOptions):
    """The pictures that a render would make, and the contents of the report."""

    out: Annotated[str | Path | None, Option("A dataset, to plan only what it lacks.", "PATH")] = None
    events: Annotated[bool, Option("Also count the time steps and renders for the events of an event camera.")] = False
    explain: Annotated[bool, Option("Also list work that is skipped because no picture needs it, and why.")] = False
