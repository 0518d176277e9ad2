"""A dataset in a format of others."""

from spin_usd.commands.export.options import ExportOptions
from spin_usd.commands.export.pictures import PATIENCE_S
from spin_usd.commands.export.report import ExportReport
from spin_usd.exchange.layout.layout import ExportFormat
from spin_usd.exchange.table import EXPORT_FORMATS
from spin_usd.options import takes
from spin_usd.processes.ask_child import ask_child


@takes(ExportOptions)
def export(options: ExportOptions) -> ExportReport:
    """Write a dataset's pictures in a format of others. Run again, it makes what is missing.

    Raises InputError and UnsupportedError for what the format cannot hold: before anything is written where records
    tell, else when its file is met. Raises OutputError.
    """
    reads, request = options.dataset, options.as_json()
    report = ask_child("export", reads=reads, progress=options.progress, within_s=PATIENCE_S, request=request)
    return ExportReport(**report)


def export_formats() -> tuple[ExportFormat, ...]:
    """Return the formats that there are, with their options."""
    return tuple(EXPORT_FORMATS.values())
