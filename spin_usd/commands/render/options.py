"""The options of `render`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import ListeningToNotes, Option, PictureOptions, RunOptions


@dataclass(frozen=True, kw_only=True)
class RenderOptions(ListeningToNotes, RunOptions, PictureOptions):
    """The pictures that a run makes, the dataset, and the way it runs."""

    out: Annotated[
        str | Path,
        Option("Folder of the dataset, or a URL: s3://bucket/name. Another run resumes.", "PATH", url=True),
    ]
    events: Annotated[
        bool,
        Option(
            "Also make the events of an event camera between the first and last picture. See docs/how-to/events.md."
        ),
    ] = False
    event_labels: Annotated[bool, Option("With each event write the ids of its target and its part.")] = False
