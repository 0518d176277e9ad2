"""The marker of a run at a URL: stores of objects have no locks, so whoever comes second is told by a file there.

Two runs that begin in the same moment may both go on: they write the same bytes, and work twice.
"""

import json
import os
import secrets
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil

from spin_usd.dataset.publish.dataset_url import MARKER, DatasetUrl
from spin_usd.errors import InputError, OutputError
from spin_usd.files.new_file import write_whole
from spin_usd.nesting import finite_json

RENEWED_S = 20.0  # between two renewals of a run's marker
OVER_S = 120.0  # a run that has not renewed its marker for so long is over: some renewals may fail


@contextmanager
def marked(url: DatasetUrl) -> Iterator[None]:
    """Mark `url` as written by this run, as long as the block.

    Raises InputError where another run is on there, and OutputError.
    """
    own = {"token": secrets.token_hex(8), "host": socket.gethostname(), "process": os.getpid()}
    _refuse_other(url, own)
    _put(url, own)
    _refuse_other(url, own)  # which came between
    ended = threading.Event()
    renewing = threading.Thread(target=_renew, args=(url, own, ended), daemon=True)
    renewing.start()
    try:
        yield
    finally:
        ended.set()
        renewing.join()
        url.remove(MARKER)


def _renew(url: DatasetUrl, own: dict[str, Any], ended: threading.Event) -> None:
    while not ended.wait(RENEWED_S):
        with suppress(OutputError):  # the next one may succeed
            _put(url, own)


def _put(url: DatasetUrl, own: dict[str, Any]) -> None:
    with tempfile.TemporaryDirectory(prefix="spin_usd-") as folder:
        file = Path(folder) / MARKER
        write_whole(file, json.dumps({**own, "time": time.time()}).encode())
        url.put(MARKER, file)


def _refuse_other(url: DatasetUrl, own: dict[str, Any]) -> None:
    """Raise InputError where a run is on whose marker has another token. Of a run on this machine its process tells,
    of others the time of the marker, since clocks of machines agree to seconds."""
    try:
        found = finite_json(url.read(MARKER) or b"{}")
        token, host, process = found["token"], str(found["host"]), int(found["process"])
        renewed = float(found["time"])
    except (ValueError, TypeError, KeyError):
        return  # none, or what no run has written
    on = psutil.pid_exists(process) if host == own["host"] else time.time() - renewed < OVER_S
    if token != own["token"] and on:
        said = f"is being written by another run (process {process} on {host})"
        do = f"wait for its end; {OVER_S:.0f} s after it was killed this goes on where it stopped"
        raise InputError(said, where=url.shown, do=do)
