"""The options of `render`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import ListeningToNotes, Option, PictureOptions, RunOptions


@dataclass(frozen=True, kw_only=True)
class RenderOptions(ListeningToNotes, RunOptions, PictureOptions):
    """What a run makes, where, and how it goes on."""

    out: Annotated[
        str | Path,
        Option("The dataset's folder, or a URL: s3://bucket/name. Run again, it resumes.", "PATH", url=True),
    ]
    events: Annotated[
        bool,
        Option(
            "Also make what an event camera tells between the first and the last picture. See docs/how-to/events.md."
        ),
    ] = False
    event_labels: Annotated[bool, Option("With each event the ids of the target and the part that it is of.")] = False
