"""The options of `check`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Argument, ListeningToNotes, Option


@dataclass(frozen=True)
class CheckOptions(ListeningToNotes):
    """What is checked, and against what."""

    path: Annotated[str | Path, Argument("A stage or a dataset.")]
    _: KW_ONLY
    repair: Annotated[
        bool,
        Option(
            "First make again what a dataset lacks or what is damaged in it, from its own copy of the stage. "
            "(render --verify does so from the stage that it is given.)",
            also="The report then says what was `repaired`, and what is `unrepaired`.",
        ),
    ] = False
    cross: Annotated[
        bool,
        Option(
            "Also cast a dataset's labels again through Cycles, which has no part in making them, and find where they "
            "differ: some 0.3 s a picture.",
            also="The report then says how many pictures were `compared`.",
        ),
    ] = False
    cross_pictures: Annotated[int | None, Option("With --cross: of so many pictures, evenly spread.", "N")] = None
