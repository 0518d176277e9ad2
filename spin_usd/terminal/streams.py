"""Standard output and error that nothing breaks: a full disk, a reader that went away, a closed descriptor.

What a command does is done either way. Whoever asked is told by the exit code when the output did not arrive.
"""

import errno
import io
import os
import sys
from typing import Any, TextIO

CLOSED = OSError(errno.EBADF, os.strerror(errno.EBADF))


class LastingStream(io.RawIOBase):
    """A descriptor that can be written for ever. `fault`: the first reason why something did not arrive, but for a
    reader that went away, such as head: that has all it wanted."""

    def __init__(self, descriptor: int, *, closed: bool) -> None:
        self._descriptor, self._closed = descriptor, closed
        self.fault: OSError | None = None

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._descriptor

    def isatty(self) -> bool:
        return os.isatty(self._descriptor)

    def write(self, data: Any, /) -> int:
        """Write what can be written, and take all."""
        try:
            if self._closed:
                raise CLOSED
            return os.write(self._descriptor, data)
        except BrokenPipeError:
            pass
        except OSError as fault:
            self.fault = self.fault or fault
        return len(data)


def lasting_streams() -> LastingStream:
    """Put streams that last in place of standard output and error, and return that of the output.

    Descriptors that are closed lead nowhere from now on: the next file opened would be taken for standard output.
    """
    given = (sys.__stdin__, sys.__stdout__, sys.__stderr__)
    for descriptor, stream in enumerate(given):
        if stream is None and not _is_open(descriptor):
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    output = LastingStream(1, closed=sys.__stdout__ is None)
    if sys.stdout is sys.__stdout__:
        sys.stdout = _text(output, sys.stdout)
    if sys.stderr is sys.__stderr__:
        sys.stderr = _text(LastingStream(2, closed=sys.__stderr__ is None), sys.stderr)
    return output


def _is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True


def _text(stream: LastingStream, old: TextIO | None) -> TextIO:
    encoding = "utf-8" if old is None else old.encoding
    return io.TextIOWrapper(io.BufferedWriter(stream), encoding, "backslashreplace", line_buffering=True)
