"""Graphics processors: which Cycles finds, and the one that renders light."""

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.renderers.blender.nodes import assign
from spin_usd.renderers.device import DEVICES
from spin_usd.scene.effort import CPU

Float32 = NDArray[np.float32]

GRAPHICS = tuple(name for name in DEVICES if name != CPU)
MAX_DIFFERENCE, MAX_PIXELS = 0.02, 4.0  # of coverage by the same rays: of itself, and of a target of a few pixels


class LightDevice:
    """The device that renders light. cycles: Cycles' settings that choose it · versions: its model, where that is not
    the CPU · proven: whether it is known to see the target as the CPU does."""

    def __init__(self, name: str) -> None:
        """Choose the device, a name in DEVICES. Raises UnsupportedError where there is none: Cycles would take the CPU
        without a word."""
        self.name = name
        self.cycles: Mapping[str, Any] = {"device": "CPU" if name == CPU else "GPU"}
        self.versions: Mapping[str, str] = {} if name == CPU else {name: _use(name)}
        self.proven = name == CPU

    def prove(self, ours: Float32, theirs: Float32) -> None:
        """Compare the coverage of a picture by the same rays, on the CPU and on this device; arrays of one shape. Where
        a device cannot run a camera's shader, Cycles renders nothing and reports a success. Raises UnsupportedError."""
        differ = float(np.abs(ours - theirs).sum())
        if differ > MAX_DIFFERENCE * float(ours.sum()) + MAX_PIXELS:
            found = f"the device {self.name} does not see the target as the CPU does: {differ:.0f} pixels differ"
            raise UnsupportedError(found, do="choose --device cpu, or another driver")
        self.proven = True


def graphics_processors() -> dict[str, list[str]]:
    """Return the models of graphics processors that Cycles can use, by the name of the device in DEVICES."""
    found = {name: [entry.name for entry in _entries(name)] for name in GRAPHICS}
    return {name: models for name, models in found.items() if models}


def _use(name: str) -> str:
    """Have Cycles use the first graphics processor of that kind, and no other; return its model."""
    entries, preferences = _entries(name), _preferences()
    if not entries:
        do = f"choose --device {' or '.join([*graphics_processors(), CPU])}"
        raise UnsupportedError(f"this machine has no device {name}", do=do)
    assign(preferences, {"compute_device_type": name.upper()})
    for entry in preferences.devices:
        assign(entry, {"use": entry.id == entries[0].id and entry.type == entries[0].type})
    return str(entries[0].name)


def _entries(name: str) -> list[Any]:
    """Return Cycles' own entries of that kind; it lists the CPU beside any."""
    return [entry for entry in _preferences().get_devices_for_type(name.upper()) if entry.type == name.upper()]


def _preferences() -> Any:
    return bpy.context.preferences.addons["cycles"].preferences
