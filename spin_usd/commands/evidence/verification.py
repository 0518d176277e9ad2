"""What verifies a dataset: pictures made again, pictures of test charts, and the figures of a report of gap."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from spin_usd.basics.progress import Progress
from spin_usd.commands.evidence.calls import CALIBRATE, Calibrate
from spin_usd.commands.evidence.report import Calibrated, ReproducedPicture
from spin_usd.commands.gap.report import GapReport
from spin_usd.commands.reproduce.run import reproduce_picture
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.formats.checked_document import read_as
from spin_usd.formats.json_file import read_json_file
from spin_usd.processes.ask_child import ask_child
from spin_usd.processes.child_limits import RENDER_PATIENCE_S, rendering_memory
from spin_usd.processes.open_renderer import require_renderer
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.picture import Picture

GAP_REPORT = "gap.json"


def reproduced_pictures(
    datasets: Sequence[Dataset], count: int, seed: int, *, progress: Progress
) -> Iterator[ReproducedPicture]:
    """Make `count` pictures again, chosen by the seed, or all of fewer. Raises as `reproduce_picture`."""
    known = [(dataset, frame, variant) for dataset in datasets for frame, variant in dataset.names]
    count = min(count, len(known))
    chosen = np.sort(np.random.default_rng(seed).choice(len(known), count, replace=False)).tolist()
    for done, (dataset, frame, variant) in enumerate((known[place] for place in chosen), 1):
        made = reproduce_picture(dataset.root, frame, variant=variant)
        yield ReproducedPicture(
            frame=frame,
            variant=variant,
            same=made.same,
            different=[file.path for file in made.files if not file.same],
            versions={name: list(pair) for name, pair in made.versions.items()},
        )
        progress("making again: picture", done, count)


def calibration_of(picture: Picture, work: Path) -> dict[str, Calibrated]:
    """Return what pictures of test charts show of the camera that made a picture. Raises InputError, StageError,
    UnsupportedError without its renderer."""
    settings, stage = picture.recorded.settings, picture.root / picture.recorded.provenance.stage.root
    require_renderer(settings.renderer)
    return ask_child(
        CALIBRATE,
        Calibrate(stage=str(stage), variant=picture.variant, settings=settings),
        reads=stage,
        memory=rendering_memory(),
        within_s=RENDER_PATIENCE_S,
        writes=(work,),
    )


def gap_figures(folder: Path) -> dict[str, dict[str, float]]:
    """Return the figures of the report of gap in a folder: real, ours and fitted, of each measure. Raises
    InputError."""
    file = folder / GAP_REPORT
    report = read_as(GapReport, read_json_file(file, MAX_DOCUMENT), file)
    names = ("real", "ours", "fitted", "gap")
    return {
        measure: {name: value for name in names if isinstance(value := getattr(of, name), float)}
        for measure, of in report.summary.items()
    }
