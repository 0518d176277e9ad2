"""A dataset in a format of others."""

from typing import TYPE_CHECKING

from spin_usd.commands.export.options import ExportOptions
from spin_usd.commands.export.report import EXPORT, ExportReport
from spin_usd.options import takes
from spin_usd.processes.ask_child import ask_child

if TYPE_CHECKING:
    from spin_usd.exchange.layout.export_format import ExportFormat

PATIENCE_S = 600.0  # a child is silent while it reads models, or writes a shard or an index of all pictures


@takes(ExportOptions)
def export(options: ExportOptions) -> ExportReport:
    """Write a dataset's pictures in another format. Another run adds what is missing.

    Raises InputError and UnsupportedError for content that the format cannot hold: before anything is written if
    records show it, else at its file. Raises OutputError.
    """
    reads, request, writes = options.dataset, options.as_json(), options.written
    return ask_child(EXPORT, request, reads=reads, progress=options.progress, within_s=PATIENCE_S, writes=writes)


def export_formats() -> "tuple[ExportFormat, ...]":
    """Return the formats that there are, with their options."""
    from spin_usd.exchange.table import EXPORT_FORMATS  # not above: the child loads it, and few need it here

    return tuple(EXPORT_FORMATS.values())
