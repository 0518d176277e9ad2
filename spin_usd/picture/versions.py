"""The software that decides a picture."""

import platform
from importlib.metadata import version

import spin_usd

LIBRARIES = ("usd-core", "bpy", "numpy", "OpenImageIO", "jsonschema", "trimesh", "embreex", "opencv-python-headless")
DECISIVE = ("usd-core", "numpy", "OpenImageIO", "embreex")
LABELLING = ("spin_usd", "python", "machine", *DECISIVE)
"""The names of what decides labels: a renderer's own software decides none."""


def library_versions() -> dict[str, str]:
    """Return what LABELLING names, with the processor family: Cycles' last bits depend on its instructions."""
    found = {name: version(name) for name in DECISIVE}
    return {
        "spin_usd": spin_usd.__version__,
        "python": platform.python_version(),
        "machine": platform.machine(),
    } | found
