"""What Blender loads when it is imported."""

import subprocess
import sys

LOADED = """
import os, sys
import spin_usd.renderers.blender.renderer
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
print(sorted({"requests", "cattrs"} & set(sys.modules)), "cycles" in bpy.context.preferences.addons, flush=True)
os._exit(0)  # the interpreter's teardown with bpy loaded can hang
"""


def test_blender_is_opened_without_its_manager_of_extensions() -> None:
    """It loads clients of the web; and of what stands for it Blender says nothing."""
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[] True"
    assert "bl_pkg" not in done.stdout + done.stderr
