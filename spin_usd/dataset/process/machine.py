"""What figures were measured on, without names or paths."""

import platform

import psutil

from spin_usd.dataset.process.processors import usable_cpus


def machine() -> dict[str, str | int]:
    """Processors that may be used, architecture, system and memory."""
    return {
        "cores": len(usable_cpus()),
        "architecture": platform.machine(),
        "system": platform.system(),
        "memory_gib": round(psutil.virtual_memory().total / 2**30),
    }
