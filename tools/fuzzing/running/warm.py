"""Run many commands in one warm process: what reads files is loaded once, and a command takes a tenth of a second.

Its children are no processes there, so a crash ends the warm process: what it finds is tried again by `run_process`,
which has the last word.
"""

import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from fuzzing.running.ended import Command, Ended, patience

START_S = 300.0  # for what it loads, on a busy machine
MARGIN_S = 5.0  # after which a command that heeds no alarm is ended
HOST = Path(__file__).with_name("warm_host.py")


class WarmRunner:
    """A warm process, started again when it has ended or after many commands."""

    COMMANDS = 1000

    def __init__(self, home: Path) -> None:
        """`home`: a folder for what its libraries keep."""
        self._home, self._count = home, 0
        self._process: subprocess.Popen[bytes] | None = None
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the runner

    def run(self, command: Command, sandbox: Path) -> Ended:
        """Run a plain command in the sandbox; code None: it hung, negative: the process crashed."""
        if self._process is None or self._count >= self.COMMANDS:
            self.close()
            self._start()
        assert self._process is not None
        began = time.monotonic()
        self._count += 1
        request: dict[str, Any] = {
            "arguments": command.arguments,
            "folder": str(sandbox / "work"),
            "patience_s": patience(),
        }
        answer = self._asked(request)
        if answer is None:
            self._process.kill()
            code = self._process.wait()
            late = time.monotonic() - began >= request["patience_s"]
            self.close()
            return Ended(code=None if late else code or -9, out="", err=self._said(), seconds=time.monotonic() - began)
        return Ended(seconds=time.monotonic() - began, **answer)

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for stream in (self._process.stdin, self._process.stdout):
                assert stream is not None
                stream.close()
            self._process = None

    def _start(self) -> None:
        self._count = 0
        self._home.mkdir(exist_ok=True)
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(HOST)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env={**os.environ, "HOME": str(self._home), "TMPDIR": str(self._home), "COLUMNS": "120"},
            start_new_session=True,
        )
        self._asked(None)  # it is ready

    def _asked(self, request: dict[str, Any] | None) -> dict[str, Any] | None:
        """The answer to `request`, or None where none comes."""
        process, heard = self._process, b""
        assert process is not None
        assert process.stdin is not None
        assert process.stdout is not None
        until = time.monotonic() + (request["patience_s"] + MARGIN_S if request else START_S)
        try:
            if request:
                process.stdin.write(json.dumps(request).encode() + b"\n")
                process.stdin.flush()
            while not heard.endswith(b"\n"):
                left = until - time.monotonic()
                if left <= 0 or not select.select([process.stdout], [], [], left)[0]:
                    return None
                more = os.read(process.stdout.fileno(), 1 << 16)
                if not more:
                    return None
                heard += more
        except BrokenPipeError:
            return None
        answer: dict[str, Any] = json.loads(heard)
        return answer

    def _said(self) -> str:
        self._log.seek(0, os.SEEK_END)
        self._log.seek(max(self._log.tell() - 2000, 0))
        return self._log.read().decode(errors="replace")


def signal_name(code: int) -> str:
    """SIGSEGV of -11."""
    return signal.Signals(-code).name
