"""The parts: one tar of Python that gzip reads, then the rest, which that Python unpacks; and their sums."""

import gzip
import hashlib
import io
import lzma
import os
import tarfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TypedDict

BLOCK = 64 << 20  # bytes that are compressed at a time, each a stream of its own: as many at once as there are cores
PRESET = 1  # 6 makes 10 % less, in four times the time
X86 = [{"id": lzma.FILTER_X86}, {"id": lzma.FILTER_LZMA2, "preset": PRESET, "dict_size": BLOCK}]
FIRST = "python.tar.gz"
REST = "rest.tar.xz"


class Part(TypedDict):
    """A part's size and sum."""

    bytes: int
    sha256: str


def write(root: Path, out: Path, part_bytes: int, *, glibc: str) -> dict[str, Part]:
    """Write all files below `root` into parts of at most `part_bytes`, python.tar.gz, rest.tar.xz.000 and so on, and
    SHA256SUMS; return the parts by name. Equal trees give equal bytes."""
    (root / "needs-glibc").write_text(f"{glibc}\n")
    everything = sorted(path for path in root.rglob("*") if path.is_symlink() or path.is_file())
    packages = root / "lib" / "python3.13" / "site-packages"
    first = [path for path in everything if not path.is_relative_to(packages)]
    rest = [path for path in everything if path.is_relative_to(packages)]
    with (out / FIRST).open("wb") as file, gzip.GzipFile("", "wb", 9, file, 0) as packed:
        packed.write(_tar(root, first))
    packed_blocks = _packed(_tar(root, rest))
    for number, data in enumerate(_cut(packed_blocks, part_bytes)):
        (out / f"{REST}.{number:03}").write_bytes(data)
    parts = {}
    for path in sorted(out.glob("*.tar.*")):
        parts[path.name] = Part(bytes=path.stat().st_size, sha256=hashlib.sha256(path.read_bytes()).hexdigest())
    (out / "SHA256SUMS").write_text("".join(f"{part['sha256']}  {name}\n" for name, part in parts.items()))
    return parts


def _tar(root: Path, files: list[Path]) -> bytes:
    """Return a tar of files, without owners and times."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=tarfile.PAX_FORMAT) as tar:
        for file in files:
            entry = tar.gettarinfo(file, str(file.relative_to(root)))
            entry.uid = entry.gid = 0
            entry.uname = entry.gname = ""
            entry.mtime = 315532800  # 1980: wheels have no earlier time
            entry.type = tarfile.REGTYPE if entry.islnk() else entry.type
            entry.size = file.stat().st_size if entry.isreg() else 0
            if entry.isreg():
                with file.open("rb") as opened:
                    tar.addfile(entry, opened)
            else:
                tar.addfile(entry)
    return out.getvalue()


def _packed(data: bytes) -> Iterator[bytes]:
    blocks = (data[start : start + BLOCK] for start in range(0, len(data), BLOCK))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from pool.map(lambda block: lzma.compress(block, filters=X86), blocks)


def _cut(blocks: Iterator[bytes], part_bytes: int) -> Iterator[bytes]:
    held = bytearray()
    for block in blocks:
        held += block
        while len(held) >= part_bytes:
            yield bytes(held[:part_bytes])
            del held[:part_bytes]
    if held:
        yield bytes(held)
