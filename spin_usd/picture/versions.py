"""The software that decides a picture."""

import platform
from importlib.metadata import version

import spin_usd

LIBRARIES = ("usd-core", "bpy", "numpy", "OpenImageIO", "jsonschema", "trimesh", "embreex", "opencv-python-headless")
IMAGING = ("opencv-python-headless", "scipy")
"""The names of what develops an image: its glare and its noise."""
LABELLING = ("spin_usd", "python", "machine", "usd-core", "numpy", "OpenImageIO", "embreex")
"""The names of what decides labels: what renders or develops an image decides none."""


def library_versions() -> dict[str, str]:
    """Return what LABELLING and IMAGING name, with the processor family: Cycles' last bits depend on its
    instructions."""
    found = {
        "spin_usd": spin_usd.__version__,
        "python": platform.python_version(),
        "machine": platform.machine(),
    }
    return found | {name: version(name) for name in (*LABELLING, *IMAGING) if name not in found}
