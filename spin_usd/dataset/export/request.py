"""The request that a user makes to `export`."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True, kw_only=True)
class ExportRequest:
    """The request that a user makes to `export`.

    dataset, out: folders · to: the format's name · split: such as "train=0.8,validation=0.2"; all is "train" where it
    is None · seed: which poses go into which split · frames: "A:B:STEP" · variants: names or patterns, all where there
    are none · target: the name of the one that formats of one target hold, the first where it is None · options: the
    format's, as text by name · copy: files are copied, not linked · workers: processes that make pictures, which change
    no byte.
    """

    dataset: Path
    to: str
    out: Path
    split: str | None = None
    seed: int = 0
    frames: str | None = None
    variants: tuple[str, ...] = ()
    target: str | None = None
    options: Mapping[str, str] = field(default_factory=dict)
    copy: bool = False
    workers: int = 1

    def as_json(self) -> dict[str, Any]:
        return {**asdict(self), "dataset": str(self.dataset), "out": str(self.out)}

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> "ExportRequest":
        paths = {name: Path(fields[name]) for name in ("dataset", "out")}
        return cls(**{**fields, **paths, "variants": tuple(fields["variants"])})
