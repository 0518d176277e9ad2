"""Folders in which the workers of a machine write: the dataset's own, or one of the machine's own, from which their
pictures are published at a URL."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.store.publish.dataset_url import DatasetUrl
from spin_usd.store.publish.node_folder import node_folder

WORK = "work"


@dataclass(frozen=True, kw_only=True)
class WorkerFolder:
    """A dataset's folder `root` to write in, the folder `work` of temporary files, and where pictures go from there."""

    root: Path
    work: Path
    url: DatasetUrl | None = None


@dataclass(frozen=True, kw_only=True)
class SharedFolder:
    """A dataset's folder that supervisor and nodes see alike: the file `seen` in its folder `work` holds `token`."""

    root: str
    work: str
    seen: str
    token: str

    @contextmanager
    def entered(self, node: str) -> Iterator[WorkerFolder]:
        """Write there for as long as the block. Raises InputError where `node` does not see the very folder."""
        work = Path(self.work)
        try:
            found = (work / self.seen).read_text(encoding="ascii")
        except (OSError, UnicodeDecodeError):
            found = ""
        if found != self.token:
            do = "give a folder that all nodes see under this path, or a URL such as s3://bucket/dataset"
            raise InputError(f"is not the same folder on the node {node}", where=self.root, do=do)
        yield WorkerFolder(root=Path(self.root), work=work)


@dataclass(frozen=True, kw_only=True)
class PublishedHere:
    """A dataset at `url`, made in a folder of this machine that has its stage already."""

    url: str
    root: str
    work: str

    @contextmanager
    def entered(self, node: str) -> Iterator[WorkerFolder]:
        """Write there for as long as the block. Raises InputError where the URL cannot be opened."""
        yield WorkerFolder(root=Path(self.root), work=Path(self.work), url=DatasetUrl(self.url))


@dataclass(frozen=True, kw_only=True)
class PublishedFromNode:
    """A dataset at `url`, made in a folder of each node's own."""

    url: str
    run: str
    """The run's token."""
    sums: str
    """See node_folder."""

    @contextmanager
    def entered(self, node: str) -> Iterator[WorkerFolder]:
        """Write there for as long as the block. Raises InputError and OutputError as node_folder does."""
        url = DatasetUrl(self.url)
        with node_folder(self.run, url, self.sums) as root:
            yield WorkerFolder(root=root, work=root.parent / WORK, url=url)


Output = SharedFolder | PublishedHere | PublishedFromNode
