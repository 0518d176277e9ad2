"""The options of the run that a worker is given when it is started."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from spin_usd.dataset.plan.effort_choice import Chosen
from spin_usd.scene.derived.content_keys import RenderSettings


@dataclass(frozen=True, kw_only=True)
class WorkerOptions:
    """A run over the stage copied into the dataset `root`. work: the folder of its temporary files · renders: whether
    any of its pictures shows light, so that a renderer is opened · chosen: why the effort is what it is, for the
    records."""

    root: str
    work: str
    stage: str
    image_suffix: str
    settings: RenderSettings
    renders: bool = True
    chosen: Chosen | None = None

    def as_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "WorkerOptions":
        settings, chosen = RenderSettings.from_json(value["settings"]), value["chosen"]
        return cls(**{**value, "settings": settings, "chosen": Chosen.from_json(chosen) if chosen else None})
