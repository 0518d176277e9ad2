"""The page of `watch`, served on this machine alone, to our own page alone."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from spin_usd.basics.nesting import typed_json
from spin_usd.browser.own_page import LOCAL, cannot_listen, is_own
from spin_usd.commands.watch.request import WatchedPicture
from spin_usd.commands.watch.state import SharedState
from spin_usd.files.folder import Folder

PAGE = Folder(Path(__file__).parent / "page")
MAX_PAGE_BYTES = 1 << 20
PAGES = {
    "/": ("page.html", "text/html; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
}
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; img-src 'self' data:; style-src 'self'; script-src 'self'; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
KEEP_ALIVE_S = 10.0
QUIET_S = 30.0  # that a connection may send no part of its request
MAX_CHOICE_BYTES = 4096


@contextmanager
def page_server(shared: SharedState, port: int) -> Iterator[str]:
    """Serve the shared state until the block ends, and yield the page's address. Raises InputError if the port is not
    available."""
    try:
        server = PageServer(shared, port)
    except (OSError, OverflowError) as error:
        raise cannot_listen(LOCAL, port, error) from None
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, name="page server")
    thread.start()
    try:
        yield f"http://{LOCAL}:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class PageServer(ThreadingHTTPServer):
    """A server of the shared state; each connection has a thread, which does not keep the program."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, shared: SharedState, port: int) -> None:
        self.shared = shared
        super().__init__((LOCAL, port), PageHandler)

    def handle_error(self, request: object, client_address: object) -> None:
        """Print nothing about a browser that went away."""


class PageHandler(BaseHTTPRequestHandler):
    """Answers the page: its files, its state as server-sent events, pictures, and its choice of a picture."""

    server: PageServer
    timeout = QUIET_S
    server_version, sys_version = "spin-usd", ""

    def do_GET(self) -> None:
        path = self.path.partition("?")[0]
        if not self._is_own():
            self._answer(HTTPStatus.FORBIDDEN, b"This page may not use spin-usd watch.\n")
        elif path in PAGES:
            name, kind = PAGES[path]
            self._answer(HTTPStatus.OK, PAGE.read(name, MAX_PAGE_BYTES), kind)
        elif path == "/state":
            self._send_state()
        elif path.startswith("/picture/") and (png := self.server.shared.picture(path.removeprefix("/picture/"))):
            self._answer(HTTPStatus.OK, png, "image/png")
        else:
            self._answer(HTTPStatus.NOT_FOUND, b"There is nothing here.\n")

    def do_POST(self) -> None:
        choice = self._choice() if self.path == "/choice" and self._is_own() and "Origin" in self.headers else None
        if choice is None:
            self._answer(HTTPStatus.FORBIDDEN, b"This cannot be chosen.\n")
        else:
            self.server.shared.choose(choice)
            self._answer(HTTPStatus.OK, b"")

    def log_message(self, format: str, *_: Any) -> None:
        """Keep the terminal for the user."""

    def _is_own(self) -> bool:
        """Return whether the request comes from our own page, or from no page."""
        return is_own(self.headers.get_all("Host", []), self.headers.get_all("Origin", []), LOCAL)

    def _choice(self) -> WatchedPicture | None:
        """Read which picture is chosen; None if the request is not a choice."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > MAX_CHOICE_BYTES:
            return None
        with suppress(ValueError):
            return typed_json(self.rfile.read(int(length)), WatchedPicture)
        return None

    def _send_state(self) -> None:
        self.send_response(HTTPStatus.OK)
        self._send_headers("text/event-stream")
        version = 0
        while not self.server.shared.closed:
            version, state = self.server.shared.state_after(version, KEEP_ALIVE_S)
            self.wfile.write(f"data: {json.dumps(state)}\n\n".encode() if state else b": still here\n\n")
            self.wfile.flush()

    def _answer(self, status: HTTPStatus, body: bytes, kind: str = "text/plain; charset=utf-8") -> None:
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self._send_headers(kind)
        self.wfile.write(body)

    def _send_headers(self, kind: str) -> None:
        for name, value in {"Content-Type": kind, **HEADERS}.items():
            self.send_header(name, value)
        self.end_headers()
