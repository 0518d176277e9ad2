"""Mutants of files in files: a member is changed, and the archive around it is whole."""

import io
import random
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable

Change = Callable[[bytes, random.Random], bytes]
ALIGNMENT = 64  # of members in usdz


def of_zip(data: bytes, rng: random.Random, change: Change) -> bytes:
    """A zip file, as npz and usdz are, with one member changed; stored, and aligned as usdz wants it."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    chosen = rng.choice(sorted(members))
    members[chosen] = change(members[chosen], rng)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name)
            end = file.tell() + 30 + len(name) + 4
            padding = -end % ALIGNMENT
            info.extra = struct.pack("<HH", 0x1986, padding) + b"\0" * padding
            archive.writestr(info, content)
    return file.getvalue()


def of_tar(data: bytes, rng: random.Random, change: Change) -> bytes:
    """A tar file with one member changed."""
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        members = [(each, archive.extractfile(each)) for each in archive.getmembers()]
        contents = [file.read() if file else b"" for _, file in members]
    chosen = rng.randrange(len(members))
    contents[chosen] = change(contents[chosen], rng)
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w") as archive:
        for (info, _), content in zip(members, contents, strict=True):
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
    return made.getvalue()


def of_png(data: bytes, rng: random.Random, change: Change) -> bytes:
    """A PNG with one chunk changed, and the sum of it right."""
    chunks, at = [], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    if not chunks:
        return change(data, rng)
    chosen = rng.randrange(len(chunks))
    kind, content = chunks[chosen]
    chunks[chosen] = (kind, change(content or b"\0", rng))
    return data[:8] + b"".join(
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )


def of_glb(data: bytes, rng: random.Random, change: Change) -> bytes:
    """A binary glTF with its document changed, and the lengths right."""
    (length,) = struct.unpack_from("<I", data, 12)
    document = change(data[20 : 20 + length], rng)
    document += b" " * (-len(document) % 4)
    rest = data[20 + length :]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(document) + len(rest))
    return head + struct.pack("<I4s", len(document), b"JSON") + document + rest


WHOLE: dict[str, Callable[[bytes, random.Random, Change], bytes]] = {
    ".usdz": of_zip,
    ".npz": of_zip,
    ".tar": of_tar,
    ".png": of_png,
    ".glb": of_glb,
}
"""By suffix, how a mutant is made that is a whole archive."""
