"""Who may ask a server of ours: our own page, and no page of a stranger that is open in the same browser."""

import ipaddress
import os
import socket
from collections.abc import Sequence
from urllib.parse import urlsplit

from spin_usd.errors import InputError

LOCAL = "127.0.0.1"
"""Where servers listen unless told otherwise: what only this machine reaches."""


def is_own(hosts: Sequence[str], origins: Sequence[str], listening: str) -> bool:
    """Return whether a request with these headers comes from our own page, or from no page: the one Host is an address,
    or a name of this machine, and the Origin, if there is one, is that Host's. `listening`: the host that the server
    was given.

    An address in the Host cannot be a stranger's name that was made to resolve to this machine.
    """
    if len(hosts) != 1 or len(origins) > 1:
        return False
    (host,) = hosts
    try:
        name = urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return False
    known = name in {"localhost", listening.lower(), socket.gethostname().lower()} or _is_address(name)
    return known and all(origin == f"http://{host}" for origin in origins)


def cannot_listen(host: str, port: int, error: OSError | OverflowError) -> InputError:
    """Return what to tell the user where a server cannot have `host` and `port`."""
    number = getattr(error, "errno", None) or 0
    reason = os.strerror(number) if number > 0 else getattr(error, "strerror", None) or str(error)
    do = "give another --port, or 0 for any that is free"
    return InputError(f"cannot listen on {host}, port {port} ({reason})", do=do)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
