"""Blender, without its manager of extensions.

Blender enables a few add-ons when it is imported. The manager is one that no render needs: it loads clients of the web,
a fourth of the import. A module of its name that is there already, and as old as its file, Blender does not load again.
"""

import os
import sys
from types import ModuleType

EXTENSIONS = "bl_pkg"  # as scripts/modules/addon_utils.py of Blender names it


def _without_extensions() -> None:
    """Let an empty add-on stand for the manager. Does nothing where Blender is loaded already."""
    empty = {"register": lambda: None, "unregister": lambda: None}
    stand_in = ModuleType(EXTENSIONS)
    vars(stand_in).update(empty, __file__=__file__, __time__=os.path.getmtime(__file__))
    sys.modules.setdefault(EXTENSIONS, stand_in)


_without_extensions()
