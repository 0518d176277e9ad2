"""A page to look at a dataset in a browser."""

from collections.abc import Sequence
from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.api.request import names_in
from spin_usd.dataset.gallery.gallery import show as show_dataset
from spin_usd.dataset.gallery.report import GalleryReport
from spin_usd.dataset.gallery.request import JPEG, GalleryRequest
from spin_usd.dataset.process.processors import refuse_workers
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.progress import Progress, ignore


@checked
def show(
    dataset: str | Path,
    *,
    out: str | Path | None = None,
    beside: str | Path | None = None,
    labels: str | Sequence[str] = "all",
    images: str = JPEG,
    workers: int | None = None,
    on_progress: Progress | None = None,
) -> GalleryReport:
    """Write a page that shows a dataset in a browser, from a folder of its own. Run again, it makes what is missing.

    Args:
        dataset: a dataset's folder.
        out: the page's folder; beside the dataset, and called after it, if not given.
        beside: another dataset, whose distributions are shown beside.
        labels: names of those that can be shown over the images; "all", or "none".
        images: "jpeg" in full size, "small" for JPEG of at most 960 pixels' width, or "original", the files themselves.
        workers: child processes; as many as there are processors if not given.
        on_progress: called with what is counted, how many are done and how many there are.

    Pictures that are damaged do not raise, they are in the report's `damaged`. Raises InputError where there is no
    dataset, or the folder holds something else, and OutputError.
    """
    if workers is not None:
        refuse_workers(workers)
    path = Path(dataset)
    request = GalleryRequest(
        dataset=path,
        out=(Path(out) if out else default_out(path)).absolute(),
        beside=Path(beside) if beside else None,
        labels=_labels(labels),
        images=images,
        workers=workers,
    )
    return show_dataset(request, progress=on_progress or ignore)


def default_out(dataset: Path) -> Path:
    """Return the folder of the page where none is given: my_dataset_page beside my_dataset."""
    absolute = dataset.absolute()
    return absolute.with_name(f"{absolute.name}_page")


def _labels(given: str | Sequence[str]) -> tuple[str, ...]:
    groups = {"all": tuple(PIXEL_LABELS), "none": ()}
    return tuple(label for name in names_in(given) for label in groups.get(name, (name,)))
