"""A run of `render`: its place, its request and its options, which all its parts share."""

from dataclasses import dataclass
from pathlib import Path

from spin_usd.basics.progress import Note, Progress
from spin_usd.commands.render.destination import Destination
from spin_usd.options import RunOptions
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.shard import Shard
from spin_usd.store.dataset_folder import Lease, Store
from spin_usd.store.names import STAGE


@dataclass(frozen=True, kw_only=True)
class RenderRun:
    """A run into a destination whose folder it holds."""

    destination: Destination
    lease: Lease
    """Hold of the destination's folder."""
    request: RenderRequest
    options: RunOptions
    shard: Shard | None = None
    """Shard to make; None for all."""
    only: frozenset[str] | None = None
    """Names of the pictures to make, whatever their records contain; None for all missing ones."""
    event_labels: bool | None = None
    """Whether events contain the ids of target and part; None for no events."""
    progress: Progress
    note: Note

    @property
    def store(self) -> Store:
        """The dataset."""
        return self.destination.store

    @property
    def owns_stage(self) -> bool:
        """Whether the stage is the dataset's own copy, perhaps edited."""
        return self.request.stage.resolve().is_relative_to(self.store.stage.resolve())

    @property
    def copied(self) -> Path:
        """Folder of the planned stage: a copy's, unless it is the dataset's own."""
        return self.store.stage.resolve() if self.owns_stage else self.lease.work / STAGE
