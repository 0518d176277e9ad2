"""The destination of a run's pictures, and the machines that make them.

Libraries for clusters and URLs are imported when needed: most runs have neither, and they load for as long as the rest.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import to_builtins

from spin_usd.commands.render.calls import OPEN_WORKER, OpenWorker
from spin_usd.files.folder import Folder
from spin_usd.files.url import is_url
from spin_usd.picture.versions import library_versions
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.pool import ChildProtocol
from spin_usd.store.atomic import write_text
from spin_usd.store.dataset_folder import Lease, Store
from spin_usd.store.lock import new_token

if TYPE_CHECKING:
    from spin_usd.processes.cluster.ray_cluster import RayCluster
    from spin_usd.processes.cluster.worker_folder import Output
    from spin_usd.store.publish.mirror import Mirror

SEEN = "seen"
StartWorker = Callable[[int], ChildProtocol]


@dataclass(frozen=True, kw_only=True)
class Destination:
    """A dataset in the folder of `store`: the dataset's own, or the folder of the `mirror` of a dataset at a URL; made
    on this machine, or on a `cluster`."""

    store: Store
    mirror: "Mirror | None" = None
    cluster: "RayCluster | None" = None

    def publish(self) -> None:
        """Copy the folder to the URL, if there is one. Raises OutputError."""
        if self.mirror:
            self.mirror.publish()

    def start(self, options: WorkerOptions, lease: Lease, workers: int) -> StartWorker | None:
        """Return a function that starts a worker by its number of so many; None for a plain child process."""
        if not self.mirror and not self.cluster:
            return None
        from spin_usd.processes.cluster.remote_child import LocalConnection, RemoteChild
        from spin_usd.processes.cluster.worker_actor import WorkerOpening

        output, versions, request = self._output(lease), library_versions(), to_builtins(OpenWorker(options=options))

        def opening(number: int, of: int | None) -> WorkerOpening:
            how = {"call": OPEN_WORKER, "request": request, "versions": versions}
            return WorkerOpening(output=output, **how, number=number, of=of)

        if cluster := self.cluster:
            return lambda _: cluster.start(lambda number: opening(number, None))
        return lambda number: RemoteChild(LocalConnection(opening(number, workers)))

    def _output(self, lease: Lease) -> "Output":
        from spin_usd.processes.cluster.worker_folder import PublishedFromNode, PublishedHere, SharedFolder
        from spin_usd.store.publish.node_folder import stage_sums

        root, work = str(self.store.root), str(lease.work)
        if not self.mirror:
            token = new_token()
            write_text(Folder(lease.work), SEEN, token, work=lease.work)
            return SharedFolder(root=root, work=work, seen=SEEN, token=token)
        url = self.mirror.url.url
        if not self.cluster:
            return PublishedHere(url=url, root=root, work=work)
        return PublishedFromNode(url=url, run=new_token(), sums=stage_sums(self.store.stage))


@contextmanager
def opened(out: str | Path, cluster: str | None) -> Iterator[Destination]:
    """Open the destination: `out` is a folder or a URL, `cluster` the address of a Ray cluster. Raises InputError and
    OutputError."""
    with ExitStack() as held:
        there = held.enter_context(_cluster(cluster)) if cluster is not None else None
        mirror = held.enter_context(_mirrored(str(out))) if is_url(out) else None
        store = mirror.store if mirror else Store(root=Path(out).absolute())
        yield Destination(store=store, mirror=mirror, cluster=there)


def _cluster(address: str) -> "RayCluster":
    from spin_usd.processes.cluster.ray_cluster import RayCluster

    return RayCluster(address)


def _mirrored(url: str) -> AbstractContextManager["Mirror"]:
    from spin_usd.store.publish.mirror import mirrored

    return mirrored(url)
