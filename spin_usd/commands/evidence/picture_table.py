"""The table of pictures: a row each, whatever its source, with the values of a domain's dimensions and its cells."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from spin_usd.basics.progress import Progress
from spin_usd.commands.evidence.calls import MEASURE_ROW, MeasureRow, PictureRow
from spin_usd.commands.evidence.domain import Places
from spin_usd.errors import SpinError
from spin_usd.processes.deaths import READING_TRIES
from spin_usd.processes.executor import done_in_order
from spin_usd.processes.processors import usable_cpus
from spin_usd.processes.task import Task
from spin_usd.reading.dataset import Dataset
from spin_usd.store.names import record_of

PICTURES_PER_CHILD = 16  # starting one takes as long as measuring so many
CELL = "_cell"
"""Ending of the columns with the number of a picture's cell."""
TYPES = {"name": "string", "variant": "string", "background": "string"}
"""Types of the columns that hold no numbers."""


def measured_rows(datasets: Sequence[Dataset], workers: int | None, *, progress: Progress) -> list[PictureRow]:
    """Return the rows of the datasets' pictures, in their order. Raises InputError for one that cannot be read."""
    requests = [
        MeasureRow(dataset=str(dataset.root), record=record_of(variant, frame))
        for dataset in datasets
        for frame, variant in dataset.names
    ]
    tasks = [Task(call=MEASURE_ROW, request=each, tries=READING_TRIES) for each in requests]
    children = workers or max(1, min(len(usable_cpus()), len(tasks) // PICTURES_PER_CHILD))
    rows: list[PictureRow] = []
    for done, task in enumerate(done_in_order(tasks, children), 1):
        if isinstance(task.failure, SpinError):
            raise task.failure
        rows.append(task.result)
        progress("measuring: picture", done, len(tasks))
    return rows


def columns_of(rows: Sequence[PictureRow]) -> Mapping[str, Sequence[Any]]:
    """Return the rows as columns by name."""
    return {name: [getattr(row, name) for row in rows] for name in PictureRow.__struct_fields__}


def write_table(path: Path, columns: Mapping[str, Sequence[Any]], places: Mapping[str, Places]) -> None:
    """Write the table of pictures as Parquet, with the number of the cell in each dimension of the domain, null for
    none."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    direction = pa.list_(pa.float64(), 3)
    kinds = {name: direction if name == "attitude" else getattr(pa, TYPES.get(name, "float64"))() for name in columns}
    arrays = {name: pa.array(list(values), kinds[name]) for name, values in columns.items()}
    cells = {f"{name}{CELL}": [int(n) if n >= 0 else None for n in found] for name, found in places.items()}
    pq.write_table(pa.table(arrays | {name: pa.array(found, pa.int64()) for name, found in cells.items()}), path)
