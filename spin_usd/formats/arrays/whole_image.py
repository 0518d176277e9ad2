"""Whether an encoded image is whole: libraries report success where some of it was lost."""

import math
import struct

PNG_HEAD = EXR_HEAD = 8  # bytes
PNG_FRAME = 12  # bytes of a chunk beside its data: length, type and checksum
EXR_ROWS = 16  # of a chunk that is compressed by ZIP


def png_is_whole(data: bytes) -> bool:
    """Return whether the chunks of a PNG follow one another up to its last byte, which ends the last: where some of
    what was written is lost, what follows lies nearer to the start. Source: the PNG specification (W3C)."""
    place: int = PNG_HEAD
    while place + PNG_FRAME <= len(data):
        size, kind = struct.unpack_from(">I4s", data, place)
        place += size + PNG_FRAME
        if kind == b"IEND":
            return place == len(data)
    return False


def exr_is_whole(data: bytes, *, rows: int) -> bool:
    """Return whether the chunks of an EXR of so many rows, compressed by ZIP, lie where its table says, up to its last
    byte. Source: "OpenEXR File Layout", files of scan lines."""
    try:
        place = _after_header(data)
        table = struct.unpack_from(f"<{math.ceil(rows / EXR_ROWS)}Q", data, place)
        place += 8 * len(table)
        for start in table:
            if start != place:
                return False
            place += 8 + struct.unpack_from("<I", data, place + 4)[0]
    except (struct.error, ValueError, IndexError):
        return False
    return place == len(data)


def _after_header(data: bytes) -> int:
    """Return where the table begins: behind attributes, each a name, a type, a size and a value."""
    place = EXR_HEAD
    while data[place]:
        for _ in ("name", "type"):
            place = data.index(0, place) + 1
        place += 4 + struct.unpack_from("<I", data, place)[0]
    return place + 1
