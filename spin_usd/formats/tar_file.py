"""Tar files: equal members give equal bytes, whoever writes them and when."""

import tarfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class Member:
    """A file in a tar file. name: its path there · source: the file that it is a copy of."""

    name: str
    source: Path


def write_tar(path: Path, members: Iterable[Member]) -> None:
    """Write a tar file with these members in their order. Names that are too long for the oldest kind of tar file get a
    header of POSIX's. Raises OSError."""
    with tarfile.open(path, "w", format=tarfile.PAX_FORMAT) as tar:
        for member in members:
            with member.source.open("rb") as file:
                header = tarfile.TarInfo(member.name)  # of nobody, from the year 1970
                header.size = member.source.stat().st_size
                tar.addfile(header, file)
