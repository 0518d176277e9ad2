"""The software that decides a picture."""

import platform
from importlib.metadata import version

import spin_usd

LIBRARIES = ("usd-core", "bpy", "numpy", "OpenImageIO", "jsonschema", "trimesh", "embreex", "opencv-python-headless")
DECISIVE = ("usd-core", "numpy", "OpenImageIO", "embreex")


def library_versions() -> dict[str, str]:
    """Return names and versions, with the processor family: Cycles' last bits depend on its instructions."""
    found = {name: version(name) for name in DECISIVE}
    return {
        "spin_usd": spin_usd.__version__,
        "python": platform.python_version(),
        "machine": platform.machine(),
    } | found
