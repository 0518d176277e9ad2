"""`spin-usd watch` as a user has it: a process, and what its page hears."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import contextmanager

from spin_usd.processes.child import IN_PROCESS

PATIENCE_S = 60


class Watched:
    """A running command, its page's address, and the states that it sends."""

    def __init__(self, process, address):
        self.process, self.address = process, address
        self._stream = urllib.request.urlopen(f"{address}state", timeout=PATIENCE_S)

    def state(self, when):
        """The next state for which `when` holds."""
        until, latest = time.monotonic() + PATIENCE_S, None
        for line in self._stream:
            assert time.monotonic() < until, f"waited in vain; the latest is {latest}"
            if line.startswith(b"data: "):
                latest = found = json.loads(line.removeprefix(b"data: "))
                if when(found):
                    return found
        raise AssertionError("the states ended")

    def shown(self, light="raycast"):
        """The next state of pictures whose image has that light."""
        return self.state(lambda state: state["status"] == "shown" and state["light"] == light)

    def faulty(self):
        return self.state(lambda state: state["status"] == "faulty")

    def picture(self, kind):
        return urllib.request.urlopen(f"{self.address}picture/{kind}", timeout=PATIENCE_S).read()

    def ask(self, path="", body=None, **headers):
        """The status of a request with these headers."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.address + path, data=data, headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
                return answer.status
        except urllib.error.HTTPError as error:
            return error.code

    def choose(self, frame, variant="nominal"):
        return self.ask("choice", {"frame": frame, "variant": variant}, Origin=self.address.rstrip("/"))

    def stop(self):
        """Ctrl-C; the exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(PATIENCE_S)


@contextmanager
def watching(stage, *options):
    """Watch the first frame of the stage."""
    command = [sys.executable, "-m", "spin_usd.command_line", "watch", stage, "--frame", "0", "--port", "0", *options]
    alone = {name: value for name, value in os.environ.items() if name != IN_PROCESS}  # children as users have them
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True, env=alone)
    try:
        yield Watched(process, process.stdout.readline().split()[0])
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()
        process.stdout.close()


def save(path, text):
    """Save as most editors do: a new file takes the place of the old one."""
    beside = path.with_name(f".{path.name}.new")
    beside.write_text(text)
    os.replace(beside, path)
