"""viser's server behind a check of the sender: requests from web pages elsewhere are refused before viser sees them.

viser accepts any Origin and Host. So a page of a stranger, open in the same browser, could connect to a server on
127.0.0.1 and drive it, and one whose name is made to resolve to 127.0.0.1 could read it. viser also moves on to the
next port if one is taken, and offers to share its page through a remote server; here it does neither.
"""

import contextlib
import io
import logging
import socket
from collections.abc import Callable, Iterator
from typing import Any

import viser
import websockets.asyncio.server

from spin_usd.browser.own_page import cannot_listen, is_own

DARK_OR_LIGHT = """<!doctype html>
<meta name="color-scheme" content="light dark">
<title>spin-usd keypoints</title>
<script>location.replace(matchMedia("(prefers-color-scheme: dark)").matches ? "/?darkMode" : "/?light");</script>
"""


class GuardedServer(viser.ViserServer):
    """viser's server, without sharing its page through another server."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        return None


@contextlib.contextmanager
def guarded_server(host: str, port: int, label: str) -> Iterator[GuardedServer]:
    """Serve at `host` and `port`, any free one if 0, until the block ends. Raises InputError if that address is not
    available."""
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # strangers' requests are not reported
    listening = _listen(host, port)
    server = _open(listening, host, label)
    try:
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):  # viser prints that it stops
            server.stop()


def _as_the_system_is(connection: Any) -> Any:
    """Answer with a page that redirects to viser's, dark if the user's system is: viser does not check that."""
    answer = connection.respond(200, DARK_OR_LIGHT)
    del answer.headers["Content-Type"]
    answer.headers["Content-Type"] = "text/html; charset=utf-8"
    return answer


def _listen(host: str, port: int) -> socket.socket:
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        return socket.create_server((host, port), family=family)
    except (OSError, OverflowError) as error:
        raise cannot_listen(host, port, error) from None


def _open(listening: socket.socket, host: str, label: str) -> GuardedServer:
    """Open viser's server on the socket, with a check before all that it answers."""
    original = websockets.asyncio.server.serve
    checked = []

    def serve(handler: Any, *_: object, process_request: Callable[..., Any], **options: Any) -> Any:
        def answer(connection: Any, request: Any) -> Any:
            if not is_own(request.headers.get_all("Host"), request.headers.get_all("Origin"), host):
                return connection.respond(403, "This page may not use spin-usd keypoints.\n")
            if request.path == "/" and "Upgrade" not in request.headers:
                return _as_the_system_is(connection)
            return process_request(connection, request)

        checked.append(listening)
        return original(handler, sock=listening, process_request=answer, **options)

    websockets.asyncio.server.serve = serve  # type: ignore[misc, assignment]
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # viser prints where it listens
            server = GuardedServer(host=host, port=listening.getsockname()[1], label=label, verbose=False)
    finally:
        websockets.asyncio.server.serve = original  # type: ignore[misc]
    if not checked:  # another version of viser, that serves in another way
        server.stop()
        raise RuntimeError("viser listens without a check of the sender")
    return server
