"""Describe the machine that figures were measured on, without names or paths."""

import platform

import psutil

from spin_usd.processes.processors import usable_cpus


def machine() -> dict[str, str | int]:
    """Return the number of processors that may be used, the architecture, the system, and the memory in GiB."""
    return {
        "cores": len(usable_cpus()),
        "architecture": platform.machine(),
        "system": platform.system(),
        "memory_gib": round(psutil.virtual_memory().total / 2**30),
    }
