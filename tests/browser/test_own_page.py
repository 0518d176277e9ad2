"""Who may ask a server of ours."""

import socket

import pytest

from spin_usd.browser.own_page import cannot_listen, is_own


@pytest.mark.parametrize(
    ("host", "origin", "expected"),
    [
        ("localhost:8642", None, True),
        ("localhost:9000", "http://localhost:9000", True),
        ("[::1]:8642", "http://[::1]:8642", True),
        ("192.168.1.7:8642", "http://192.168.1.7:8642", True),
        ("lab.example:8642", "http://lab.example:8642", True),
        ("localhost:8642", "http://localhost:3000", False),
        ("localhost:8642", "https://localhost:8642", False),
        ("127.0.0.1.evil.example:8642", None, False),
        ("", None, False),
        ("[", None, False),
    ],
)
def test_who_is_our_own_page(host, origin, expected) -> None:
    origins = [] if origin is None else [origin]
    assert is_own([host], origins, "lab.example") is expected
    assert not is_own([host, host], origins, "lab.example")
    assert not is_own([], origins, "lab.example")
    assert not is_own([host], [f"http://{host}"] * 2, "lab.example")


def test_a_port_that_is_taken_is_said_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(OSError, match="in use") as raised:
        socket.create_server(taken.getsockname())
    said = str(cannot_listen("127.0.0.1", 8642, raised.value))
    assert "port 8642 (Address already in use); " in said
