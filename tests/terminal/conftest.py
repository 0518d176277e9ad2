"""A real pseudo-terminal for the tests of what people see."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios

import pytest


@pytest.fixture(scope="session")
def at_terminal():
    """Run Python with these arguments at a terminal `columns` wide; returns all that it wrote, as text."""

    def run(*arguments, columns=80, **environment):
        ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
        kept = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "NO_COLOR")}
        child = subprocess.Popen(
            [sys.executable, *arguments],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            env={**kept, "TERM": "xterm-256color", **environment},
        )
        os.close(theirs)
        written = _all_of(ours)
        assert child.wait() == 0, written
        return written

    return run


def _all_of(terminal):
    """Read what is written until the last one that writes has ended, which Linux says as an input/output error."""
    parts = []
    try:
        while part := os.read(terminal, 1 << 16):
            parts.append(part)
    except OSError:
        pass
    finally:
        os.close(terminal)
    return b"".join(parts).decode()
