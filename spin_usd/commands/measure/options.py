"""The options of `measure`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.errors import InputError
from spin_usd.options import MAX_WORKERS, Frames, ListeningToNotes, Option, Stage
from spin_usd.scene.effort import MAX_SAMPLES

MAX_PICTURES, MAX_SEEDS = 100, 64  # well beyond what is of use, and a slip of the hand is caught


@dataclass(frozen=True)
class MeasureOptions(ListeningToNotes):
    """What is measured, and how well. Raises InputError for numbers that no measurement can have."""

    stage: Stage
    _: KW_ONLY
    out: Annotated[
        str | Path | None,
        Option("Folder for the figures; `measured` beside the stage if not given. Run again, it resumes.", "PATH"),
    ] = None
    frames: Frames = None
    count: Annotated[int, Option("How many frames, 1 to 100, from a small target to a large one.", "N")] = 3
    variant: Annotated[str, Option("The variant to measure.", "NAME")] = "nominal"
    seeds: Annotated[int, Option("Renders of each setting, 2 to 64.", "N")] = 3
    max_samples: Annotated[int, Option("The most light samples per pixel of a setting.", "N")] = 64
    reference_share: Annotated[
        float,
        Option("The reference is good enough when its squared error is this share of the smallest one.", "X"),
    ] = 0.1
    reference_samples: Annotated[int, Option("The most light samples per pixel of the reference.", "N")] = 4096
    workers: Annotated[
        int, Option("Processes that share the cores; 1 for truest times.", "N", at_least=1, at_most=MAX_WORKERS)
    ] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        few = f"measure 1 to {MAX_PICTURES}: they stand for the others"
        _refuse_unless(1 <= self.count <= MAX_PICTURES, f"{self.count} pictures are asked for", few)
        spread = f"take 2 to {MAX_SEEDS}: their spread is measured"
        _refuse_unless(2 <= self.seeds <= MAX_SEEDS, f"{self.seeds} seeds are asked for", spread)
        well = 1 <= self.max_samples <= self.reference_samples <= MAX_SAMPLES
        found = f"settings of {self.max_samples} samples and a reference of {self.reference_samples} are asked for"
        _refuse_unless(well, found, f"let them be at least 1, the reference's not fewer, and at most {MAX_SAMPLES}")
        share = f"a reference with a share of {self.reference_share:g} of the error is asked for"
        _refuse_unless(0 < self.reference_share <= 1, share, "make it above 0 and at most 1")
        _refuse_unless(self.variant != "all", "all variants are asked for", "measure one at a time")


def _refuse_unless(well: bool, found: str, do: str) -> None:
    if not well:
        raise InputError(found, do=do)
