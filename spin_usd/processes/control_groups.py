"""The limits of the control groups that hold this process, as of a container or a batch system."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

CGROUPS = Path("/sys/fs/cgroup")
OWN = Path("/proc/self/cgroup")


def group_limits(controller: str, first: Sequence[str], second: str) -> Iterator[list[str]]:
    """Yield the words of a limit in each control group that holds us, from ours up; a container may see only its own.

    `first`: the limit's files in version 1, where the controller has a hierarchy of its own; `second`: its file in
    version 2, which has one hierarchy. Source: cgroups(7).
    """
    with suppress(OSError):
        for line in OWN.read_text(encoding="utf-8").splitlines():
            _, controllers, path = line.split(":", 2)
            if controller in controllers.split(","):
                yield from _up_from(CGROUPS / controller, path, first)
            elif not controllers:
                yield from _up_from(CGROUPS, path, [second])


def _up_from(root: Path, path: str, names: Sequence[str]) -> Iterator[list[str]]:
    group = root / path.lstrip("/")
    for folder in (group, *group.parents):
        if folder.is_relative_to(root):
            with suppress(OSError):  # no such group here
                yield [word for name in names for word in (folder / name).read_text(encoding="ascii").split()]
