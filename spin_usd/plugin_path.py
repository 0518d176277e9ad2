"""Print the folder that other USD programs need in PXR_PLUGINPATH_NAME to know spin_usd's schema.

`python -m spin_usd.plugin_path` imports neither pxr nor bpy, so it can run before either is loaded.
"""

from pathlib import Path

from spin_usd.basics.resources import schemas


def plugin_path() -> Path:
    """Return the folder that holds the USD plug-in's plugInfo.json."""
    return schemas() / "spin"


if __name__ == "__main__":
    print(plugin_path())
