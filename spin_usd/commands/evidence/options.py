"""The options of `evidence`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.errors import InputError
from spin_usd.options import Dataset, ListeningToNotes, Option, Workers


@dataclass(frozen=True)
class EvidenceOptions(ListeningToNotes):
    """The dataset, the domain that it shall cover, and what to add to the evidence."""

    dataset: Dataset
    _: KW_ONLY
    domain: Annotated[
        str | Path, Option("The operational domain: dimensions, their limits and cells, as TOML.", "FILE.toml")
    ]
    out: Annotated[
        str | Path, Option("Folder of the evidence: index.html, evidence.json and pictures.parquet.", "FOLDER")
    ]
    also: Annotated[
        Sequence[str] | Sequence[Path],
        Option("Another dataset that counts too, such as pictures for the holes; repeatable.", "FOLDER", repeated=True),
    ] = ()
    fill: Annotated[
        str | Path | None,
        Option("Also write a specification of pictures for the holes, for author --sample.", "FILE.toml"),
    ] = None
    camera: Annotated[
        str | Path | None, Option("Calibration of a data set of others that holds none, as `check` takes it.", "FILE")
    ] = None
    gap: Annotated[
        str | Path | None, Option("A report of spin-usd gap, whose figures the evidence repeats.", "FOLDER")
    ] = None
    reproduce: Annotated[int, Option("How many pictures, by chance, to make again.", "N", at_least=0)] = 3
    seed: Annotated[int, Option("Seed by which they are chosen.", "N", at_least=0)] = 0
    workers: Workers = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.fill is not None and Path(self.fill).suffix != ".toml":
            raise InputError("cannot be a specification", where=self.fill, do="give a name that ends in .toml")
