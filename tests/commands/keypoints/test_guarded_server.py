"""The server of the keypoint tool: who may ask it, and what it says of an address that it cannot have."""

import http.client
import socket
import urllib.request

import pytest

from spin_usd.commands.keypoints.guarded_server import guarded_server
from spin_usd.errors import InputError

LOCAL = "127.0.0.1"


@pytest.fixture(scope="module")
def server():
    with guarded_server(LOCAL, 0, "test") as server:
        yield server


def status(server, upgrade=False, **headers):
    """What a GET with these headers is answered."""
    connection = http.client.HTTPConnection(LOCAL, server.get_port(), timeout=30)
    socket_headers = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    }
    connection.request("GET", "/", headers=headers | (socket_headers if upgrade else {}))
    found = connection.getresponse().status
    connection.close()
    return found


def test_only_its_own_page_may_ask_it(server) -> None:
    own = f"{LOCAL}:{server.get_port()}"
    for upgrade, allowed in ((False, 200), (True, 101)):
        assert status(server, upgrade) == allowed
        assert status(server, upgrade, Host=own, Origin=f"http://{own}") == allowed
        assert status(server, upgrade, Host=own, Origin="http://elsewhere.example") == 403
        assert status(server, upgrade, Host=own, Origin="null") == 403
        assert status(server, upgrade, Host="rebound.example", Origin="http://rebound.example") == 403


@pytest.mark.parametrize("name", ["Host", "Origin"])
def test_a_header_that_stands_twice_is_nobodys(server, name) -> None:
    own = f"{LOCAL}:{server.get_port()}"
    said = {"Host": own, "Origin": f"http://{own}"}
    lines = "".join(f"{key}: {value}\r\n" for key, value in said.items())
    with socket.create_connection((LOCAL, server.get_port()), timeout=30) as asking:
        asking.sendall(f"GET / HTTP/1.1\r\n{lines}{name}: {said[name]}\r\n\r\n".encode())
        assert asking.recv(64).startswith(b"HTTP/1.1 403 ")


def test_its_page_is_as_light_as_the_system(server) -> None:
    found = {}
    for path in ("/", "/?darkMode", "/?light"):
        with urllib.request.urlopen(f"http://{LOCAL}:{server.get_port()}{path}", timeout=30) as answer:
            found[path] = answer.headers["Content-Type"], answer.read()
    assert found["/"][0] == "text/html; charset=utf-8"
    assert b'prefers-color-scheme: dark)").matches ? "/?darkMode" : "/?light"' in found["/"][1]
    assert found["/?darkMode"][1] == found["/?light"][1] != found["/"][1]


def test_it_listens_on_this_machine_alone(server) -> None:
    name = socket.getaddrinfo(LOCAL, None)[0][4][0]
    with pytest.raises(OSError, match="refused"):
        socket.create_connection((name.replace("127.0.0.1", "127.0.0.2"), server.get_port()), timeout=5)


def test_it_shares_nothing_elsewhere(server) -> None:
    assert server.request_share_url() is None


def test_a_taken_port_is_said(server) -> None:
    with pytest.raises(InputError, match="give another --port"), guarded_server(LOCAL, server.get_port(), "second"):
        pass
