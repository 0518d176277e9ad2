"""The options of a run for its workers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from spin_usd.planning.effort_choice import Chosen
from spin_usd.scene.derived.content_keys import RenderSettings


@dataclass(frozen=True, kw_only=True)
class WorkerOptions:
    """A run over the stage copied into a dataset.

    root: the dataset's folder
    work: the folder of its temporary files
    options: the user's, as far as records list them (`PictureOptions.recorded`)
    renders: whether any of its pictures shows light, so that a renderer is opened
    chosen: the reason for the effort, for the records
    """

    root: str
    work: str
    stage: str
    settings: RenderSettings
    options: Mapping[str, Any] = field(default_factory=dict)
    renders: bool = True
    chosen: Chosen | None = None

    @property
    def image_suffix(self) -> str:
        return f".{self.options.get('image_format', 'png')}"
