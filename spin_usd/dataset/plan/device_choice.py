"""The device that renders a run's light: the first of those offered that can render all its pictures."""

from collections.abc import Iterable, Sequence

from spin_usd.renderers.device import DEVICES, needs_shader, shader_refusal
from spin_usd.scene.model import Scene


def chosen_device(offered: Sequence[str], scenes: Iterable[Scene]) -> str:
    """Return the first of the devices `offered`, names in DEVICES, that can render all of `scenes`, which are read only
    as far as that is in doubt. Raises UnsupportedError where none can."""
    if DEVICES[offered[0]].shaders:
        return offered[0]
    shaded = next(filter(needs_shader, scenes), None)
    able = [name for name in offered if shaded is None or DEVICES[name].shaders]
    if shaded and not able:
        raise shader_refusal(offered[0], shaded)
    return able[0]
