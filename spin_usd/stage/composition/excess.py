"""The number of prims of a composition, counted before USD opens it: a few lines can make 2^30 of them."""

from collections import deque

from pxr import Pcp, Sdf

from spin_usd.errors import StageError

MAX_PRIMS = 200_000
MAX_DEPTH = 256  # prims below one another: USD composes and walks them by recursion, which overflows its stack


def refuse_excess(root: Sdf.Layer, session: Sdf.Layer | None, where: object) -> None:
    """Raise StageError where the layers compose to more than MAX_PRIMS prims, those in instances included, or nest them
    deeper than MAX_DEPTH.

    Every prim is composed alone, payloads and all, from the top down and only as far as the limits.
    """
    cache = Pcp.Cache(Pcp.LayerStackIdentifier(root, session), usd=True)
    waiting, count = deque([Sdf.Path.absoluteRootPath]), 0
    while waiting:
        path = waiting.popleft()
        names = _children(cache, path)
        waiting.extend(path.AppendChild(name) for name in names)
        count += len(names)
        if count > MAX_PRIMS:
            raise StageError(f"has more than {MAX_PRIMS} prims", where=where, do="merge meshes, or split it")
        if path.pathElementCount > MAX_DEPTH:
            raise StageError(f"nests prims deeper than {MAX_DEPTH}", where=where, do="flatten it")


def _children(cache: Pcp.Cache, path: Sdf.Path) -> list[str]:
    index = cache.ComputePrimIndex(path)[0]
    if index.hasAnyPayloads:
        cache.RequestPayloads([path], [])
        index = cache.ComputePrimIndex(path)[0]
    names: list[str] = index.ComputePrimChildNames()[0]
    return names
