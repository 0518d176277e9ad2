"""The options of `measure`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.errors import InputError
from spin_usd.options import MAX_WORKERS, Frames, ListeningToNotes, Option, Stage
from spin_usd.scene.effort import MAX_SAMPLES

MAX_PICTURES, MAX_SEEDS = 100, 64  # well beyond any use, to catch slips of the hand


@dataclass(frozen=True)
class MeasureOptions(ListeningToNotes):
    """The stage to measure, and the precision. Raises InputError for numbers out of range."""

    stage: Stage
    _: KW_ONLY
    out: Annotated[
        str | Path | None,
        Option("Folder of the results; `measured` beside the stage if not given. Another run resumes.", "PATH"),
    ] = None
    frames: Frames = None
    count: Annotated[int, Option("Number of frames, 1 to 100, from a small target to a large one.", "N")] = 3
    variant: Annotated[str, Option("The variant to measure.", "NAME")] = "nominal"
    seeds: Annotated[int, Option("Renders of each setting, 2 to 64.", "N")] = 3
    max_samples: Annotated[int, Option("Largest number of light samples per pixel of a setting.", "N")] = 64
    reference_share: Annotated[
        float,
        Option("Squared error at which the reference is good enough, as a share of the smallest one.", "X"),
    ] = 0.1
    reference_samples: Annotated[int, Option("Largest number of light samples per pixel of the reference.", "N")] = 4096
    workers: Annotated[
        int, Option("Processes that share the cores; 1 for the most exact times.", "N", at_least=1, at_most=MAX_WORKERS)
    ] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        few = f"make it 1 to {MAX_PICTURES}: they represent the others"
        _refuse_unless(1 <= self.count <= MAX_PICTURES, f"count is {self.count}", few)
        spread = f"make it 2 to {MAX_SEEDS}: their spread is measured"
        _refuse_unless(2 <= self.seeds <= MAX_SEEDS, f"seeds is {self.seeds}", spread)
        well = 1 <= self.max_samples <= self.reference_samples <= MAX_SAMPLES
        found = f"max_samples is {self.max_samples} and reference_samples is {self.reference_samples}"
        _refuse_unless(well, found, f"make both 1 to {MAX_SAMPLES}, the reference's not fewer")
        share = f"reference_share is {self.reference_share:g}"
        _refuse_unless(0 < self.reference_share <= 1, share, "make it above 0 and at most 1")
        _refuse_unless(self.variant != "all", "variant is all", "measure one at a time")


def _refuse_unless(well: bool, found: str, do: str) -> None:
    if not well:
        raise InputError(found, do=do)
