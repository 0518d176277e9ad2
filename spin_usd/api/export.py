"""A dataset in a format of others."""

from collections.abc import Sequence
from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.api.request import names_in
from spin_usd.dataset.export.formats.table import EXPORT_FORMATS
from spin_usd.dataset.export.layout.layout import ExportFormat
from spin_usd.dataset.export.pictures import PATIENCE_S
from spin_usd.dataset.export.report import ExportReport
from spin_usd.dataset.export.request import ExportRequest
from spin_usd.dataset.process.ask_child import ask_child
from spin_usd.dataset.process.processors import refuse_workers
from spin_usd.errors import InputError
from spin_usd.progress import Progress


@checked
def export(
    dataset: str | Path,
    *,
    to: str,
    out: str | Path,
    split: str | None = None,
    seed: int = 0,
    frames: str | None = None,
    variants: str | Sequence[str] = (),
    target: str | None = None,
    option: str | Sequence[str] = (),
    copy: bool = False,
    workers: int = 1,
    on_progress: Progress | None = None,
) -> ExportReport:
    """Write a dataset's pictures in a format of others. Run again, it makes what is missing.

    Args:
        dataset: a dataset's folder.
        to: the format's name, such as "speedplus".
        out: the folder of the export, a new one or that of the same export.
        split: the share of each split, such as "train=0.8,validation=0.2"; all is "train" if not given.
        seed: decides which poses go into which split; all variants of a pose go together.
        frames: some of the frames, "A:B:STEP" as Python slices.
        variants: names, or patterns such as "noisy_*", or "all"; all if not given.
        target: the name of the target, for formats that hold one; the first if not given.
        option: options of the format, "NAME=VALUE" each.
        copy: copy files that need no change, instead of hard links to them.
        workers: processes that make pictures; their number changes no byte.
        on_progress: called with what is counted, how many are done and how many there are.

    Raises InputError and UnsupportedError for what the format cannot hold: before anything is written where records
    tell, else when its file is met. Raises OutputError.
    """
    refuse_workers(workers)
    request = ExportRequest(
        dataset=Path(dataset),
        to=to,
        out=Path(out),
        split=split,
        seed=seed,
        frames=frames,
        variants=names_in(variants),
        target=target,
        options=_options(names_in(option)),
        copy=copy,
        workers=workers,
    )
    report = ask_child(
        "export",
        reads=request.dataset,
        progress=on_progress,
        within_s=PATIENCE_S,
        request=request.as_json(),
    )
    return ExportReport(**report)


def export_formats() -> tuple[ExportFormat, ...]:
    """Return the formats that there are, with their options."""
    return tuple(EXPORT_FORMATS.values())


def _options(given: Sequence[str]) -> dict[str, str]:
    """Return the values by name of "NAME=VALUE" texts. Raises InputError."""
    found: dict[str, str] = {}
    for text in given:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not name or name in found:
            raise InputError(f"option {text!r} is not NAME=VALUE", do="write for example masks=parts, each name once")
        found[name] = value
    return found
