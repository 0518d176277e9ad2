"""Image files for tests, written by other libraries than the one that reads them."""

import struct
import zlib


def png(values, *, color, depth=8, chunks=()):
    """The bytes of a PNG file by its own specification. values (H, W, C) whole numbers; color: its colour type."""
    dtype = ">u2" if depth == 16 else "u1"
    rows = b"".join(b"\0" + row.astype(dtype).tobytes() for row in values)
    header = struct.pack(">IIBBBBB", values.shape[1], values.shape[0], depth, color, 0, 0, 0)
    body = [(b"IHDR", header), *chunks, (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*chunk) for chunk in body)


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def gamma_chunk(gamma):
    return b"gAMA", struct.pack(">I", round(gamma * 1e5))
