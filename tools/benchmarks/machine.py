"""What figures were measured on, without names or paths."""

import platform
from importlib.metadata import version

from spin_usd.dataset.machine import machine

PACKAGES = ("bpy", "usd-core", "numpy", "OpenImageIO", "embreex")


def described() -> dict[str, object]:
    """Cores that may be used, architecture, memory and versions."""
    return {**machine(), "versions": {"python": platform.python_version(), **{n: version(n) for n in PACKAGES}}}
