"""The options of `check`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Argument, ListeningToNotes, Option


@dataclass(frozen=True)
class CheckOptions(ListeningToNotes):
    """The stage or dataset to check, and the checks to run."""

    path: Annotated[str | Path, Argument("A stage or a dataset.")]
    _: KW_ONLY
    repair: Annotated[
        bool,
        Option(
            "First make missing and damaged files of a dataset again, from its own copy of the stage. (render "
            "--verify does the same from a given stage.)",
            also="The report then lists what was `repaired`, and what is `unrepaired`.",
        ),
    ] = False
    cross: Annotated[
        bool,
        Option(
            "Also make a dataset's labels again with Cycles, an independent ray caster, and report differences: about "
            "0.3 s per picture.",
            also="The report then contains the number of pictures `compared`.",
        ),
    ] = False
    cross_pictures: Annotated[int | None, Option("With --cross: compare only N pictures, evenly spread.", "N")] = None
