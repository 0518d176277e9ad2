"""The software that decides a picture."""

import platform
from importlib.metadata import version

import spin_usd

LIBRARIES = ("usd-core", "bpy", "numpy", "OpenImageIO", "jsonschema", "trimesh", "embreex", "opencv-python-headless")
IMAGING = ("opencv-python-headless", "scipy")
"""Names of the software that develops an image: its glare and its noise."""
LABELLING = ("spin_usd", "python", "machine", "usd-core", "numpy", "OpenImageIO", "embreex")
"""Names of the software that decides labels, which no renderer or sensor does."""


def library_versions() -> dict[str, str]:
    """Return the versions of LABELLING and IMAGING, with the processor family: Cycles' last bits depend on its
    instructions."""
    found = {
        "spin_usd": spin_usd.__version__,
        "python": platform.python_version(),
        "machine": platform.machine(),
    }
    return found | {name: version(name) for name in (*LABELLING, *IMAGING) if name not in found}
