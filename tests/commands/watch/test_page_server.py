"""The page's server: a connection that says nothing is closed, and keeps no other waiting."""

import socket
import urllib.request
from urllib.parse import urlsplit

from spin_usd.commands.watch import page_server as served
from spin_usd.commands.watch.request import WatchedPicture
from spin_usd.commands.watch.state import SharedState


def test_a_connection_that_says_nothing_is_closed(monkeypatch) -> None:
    monkeypatch.setattr(served.PageHandler, "timeout", 0.5)
    with served.page_server(SharedState(WatchedPicture(frame="a", variant="nominal")), 0) as address:
        place = urlsplit(address)
        with socket.create_connection((place.hostname, place.port), timeout=30) as silent:
            assert urllib.request.urlopen(address, timeout=30).status == 200
            assert silent.recv(1) == b"", "closed by the server"
