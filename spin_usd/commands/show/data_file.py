"""The data files of a gallery: scripts, for a page that was opened from a disk may load nothing else than scripts."""

import base64
import hashlib
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

ALIGNMENT = 8  # bytes; browsers make typed arrays at such places alone
LEVEL = 6  # of zlib; 9 takes three times as long for 1 % less
KEY_LENGTH = 16  # hexadecimal digits: that two of a million files have the same is a chance of 3e-8


class DataFile:
    """A JSON header and arrays by their names, which a script hands to the page.

    The script holds base64 text alone, so no browser reads anything of a dataset as a program. The text decodes to
    bytes that zlib packed: the length of the header (uint32), the header with the place of each array, and the arrays,
    little-endian.
    """

    def __init__(self, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] | None = None) -> None:
        places, blocks, end = {}, [], 0
        for name, array in (arrays or {}).items():
            data = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
            places[name] = {"dtype": array.dtype.name, "offset": end, "length": array.size}
            blocks.append(data + bytes(-len(data) % ALIGNMENT))
            end += len(blocks[-1])
        head = json.dumps({**header, "arrays": places}, separators=(",", ":")).encode()
        head += b" " * (-(len(head) + 4) % ALIGNMENT)
        self._content = b"".join([len(head).to_bytes(4, "little"), head, *blocks])

    @property
    def key(self) -> str:
        """A key that is the same for the same content alone."""
        return file_key(self._content)

    def script(self, key: str) -> bytes:
        """Return the script that hands it to the page under that key."""
        packed = base64.b64encode(zlib.compress(self._content, LEVEL))
        return b'giveData("%s","%s");\n' % (key.encode("ascii"), packed)


def file_key(*contents: bytes) -> str:
    """Return the key of files that are made of these contents."""
    return hashlib.sha256(b"\0".join(contents)).hexdigest()[:KEY_LENGTH]
