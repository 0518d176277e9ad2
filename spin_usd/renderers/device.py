"""The devices that can render light, and the limits of graphics processors."""

from collections.abc import Mapping
from dataclasses import dataclass

from spin_usd.errors import UnsupportedError
from spin_usd.renderers.camera_shader import NEAR_RADII, View
from spin_usd.scene.effort import CPU
from spin_usd.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Device:
    """A kind of device."""

    name: str
    """In `--device` and in records; in capitals also Cycles' own."""
    shaders: bool
    """Whether Cycles runs shaders in OSL there, as every lens but a near pinhole takes. Source: Blender's manual, Open
    Shading Language."""


_ALL = (  # the fastest first
    Device(name="optix", shaders=True),
    Device(name="cuda", shaders=False),
    Device(name="hip", shaders=False),
    Device(name="metal", shaders=False),
    Device(name="oneapi", shaders=False),
    Device(name=CPU, shaders=True),
)
DEVICES: Mapping[str, Device] = {device.name: device for device in _ALL}


def needs_shader(scene: Scene) -> bool:
    """Return whether the picture of `scene` is rendered through the camera shader: the lens distorts, blurs, or is very
    short or long, or the target is so far that rays start at it."""
    return not View.blurred(scene).plain


def shader_refusal(name: str, scene: Scene) -> UnsupportedError:
    """Return the error that the device of that name cannot render the picture of `scene`."""
    able = " or ".join(device.name for device in reversed(_ALL) if device.shaders)
    shaded = f"a lens that distorts, blurs, or is very short or long, or a target beyond {NEAR_RADII:g} radii"
    return UnsupportedError(
        f"cannot be rendered on {name}: only {able} can for {shaded}",
        where=f"picture {scene.frame.variant}/{scene.frame.name}",
        do=f"choose --device {able}",
    )
