"""Text files of others, in whatever encoding their exporters chose."""

import codecs
from pathlib import Path

from spin_usd.errors import InputError

UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def read_text(path: Path) -> str:
    """Read the text of the file: UTF-16 where its byte order mark says so, else UTF-8, or Latin-1 where it is not.

    Raises InputError for a file that cannot be read, or that is binary.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=path, do="check the path") from None
    if data.startswith(UTF_16):
        return data.decode("utf-16", errors="replace")
    if b"\0" in data[:4096]:
        raise InputError("is not a text file", where=path, do="give one of the kinds that the option names")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
