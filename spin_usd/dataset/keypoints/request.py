"""What is asked of the keypoint tool."""

from dataclasses import dataclass
from pathlib import Path

from spin_usd.dataset.serve.own_page import LOCAL

PORT = 8642


@dataclass(frozen=True, kw_only=True)
class KeypointsRequest:
    """What is asked of the tool. target: a name or a model file · out: the layer that is gone on with and saved into;
    named after the target if not given · units_per_metre, prim, any_size: as `author` takes them · host, port: where it
    listens, any free port for 0 · pictures: a dataset into whose pictures the keypoints are drawn."""

    target: str
    out: Path | None = None
    units_per_metre: float | None = None
    prim: str | None = None
    any_size: bool = False
    host: str = LOCAL
    port: int = PORT
    pictures: Path | None = None

    @property
    def is_local(self) -> bool:
        """Whether only this machine can connect."""
        return self.host in (LOCAL, "localhost", "::1")
