"""Blender, without its manager of extensions.

Blender enables a few add-ons when it is imported. No render needs the manager: it loads web clients, a fourth of the
import. Blender does not reload an existing module of its name that is as old as its file.
"""

import os
import sys
from types import ModuleType

EXTENSIONS = "bl_pkg"  # as scripts/modules/addon_utils.py of Blender names it


def _without_extensions() -> None:
    """Replace the manager by an empty add-on. Does nothing if Blender is loaded already."""
    empty = {"register": lambda: None, "unregister": lambda: None}
    stand_in = ModuleType(EXTENSIONS)
    vars(stand_in).update(empty, __file__=__file__, __time__=os.path.getmtime(__file__))
    sys.modules.setdefault(EXTENSIONS, stand_in)


_without_extensions()
