"""Limit Blender to one thread, for work that several threads do not reproduce.

Embree builds a mesh's tree of boxes by as many threads as there are, and by two or more it is now and then another: in
5 of 60 builds of Tango by two. A ray that meets the edge of two triangles then finds the other one, and the last bits
of a few pixels differ.
"""

import ctypes
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import bpy

# What global_control's own constructor and destructor call.
CREATE, DESTROY = (f"_ZN3tbb6detail2r1{name}ERNS0_2d114global_controlE" for name in ("6create", "7destroy"))
MOST_THREADS = 0  # oneTBB's global_control::max_allowed_parallelism


class GlobalControl(ctypes.Structure):
    """oneTBB's class of that name: what it controls, and its value."""

    _fields_ = (("value", ctypes.c_size_t), ("reserved", ctypes.c_ssize_t), ("parameter", ctypes.c_int))


@contextmanager
def one_thread() -> Iterator[None]:
    """Let oneTBB, by which Blender, Cycles and Embree share out work, use the calling thread alone, until the end; on
    Linux, for elsewhere its functions have other names."""
    if sys.platform != "linux":
        yield
        return
    control = ctypes.byref(GlobalControl(value=1, parameter=MOST_THREADS))
    _library()[CREATE](control)
    try:
        yield
    finally:
        _library()[DESTROY](control)


@cache
def _library() -> ctypes.CDLL:
    """Return Blender's copy of oneTBB."""
    return ctypes.CDLL(str(Path(bpy.utils.resource_path("LOCAL")).parent / "lib" / "libtbb.so.12"))
