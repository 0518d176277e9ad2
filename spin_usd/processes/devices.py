"""The devices of this machine, listed by a child: a driver may crash, hang, or reserve all address space."""

from collections.abc import Mapping

from spin_usd.errors import InputError, UnsupportedError
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import rendering_memory
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.open_renderer import GRAPHICS_PROCESSORS, RENDERERS
from spin_usd.renderers.device import DEVICES
from spin_usd.scene.effort import CPU

AUTO = "auto"  # the best device that this machine has, and that can render the light
PATIENCE_S = 60.0  # for Blender to start and all drivers to answer


def refuse_unknown_device(name: str, *more: str) -> None:
    """Raise InputError unless `name` is one of DEVICES, or of `more`."""
    if name not in DEVICES and name not in more:
        do = f"choose {' or '.join([CPU, *more, *(other for other in DEVICES if other != CPU)])}"
        raise InputError(f"there is no device {name!r}", do=do)


def graphics_processors() -> Mapping[str, list[str]]:
    """Return the models of graphics processors by the name of the device; empty unless a renderer that can use them is
    installed. Raises ChildDiedError if a driver crashes or hangs."""
    if not any(entry.graphics and entry.installed for entry in RENDERERS.values()):
        return {}
    with Child(memory=rendering_memory(graphics=True), writes=None) as child:
        return child.call(GRAPHICS_PROCESSORS, None, within_s=PATIENCE_S)


def usable_devices() -> list[str]:
    """Return the names of the devices of this machine, the fastest first. Raises UnsupportedError where the search for
    them fails."""
    try:
        found = graphics_processors()
    except ChildDiedError as died:
        do = "choose --device cpu, or check the graphics driver"
        raise UnsupportedError(f"the devices of this machine cannot be listed: {died}", do=do) from died
    return [name for name in DEVICES if name == CPU or name in found]


def require_device(name: str) -> None:
    """Raise UnsupportedError where this machine has no such device; the CPU is always there."""
    if name != CPU and name not in (usable := usable_devices()):
        raise UnsupportedError(f"this machine has no device {name}", do=f"choose --device {' or '.join(usable)}")
