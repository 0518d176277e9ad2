"""Print digests of a stage's labels by the kernels of Embree that are asked for: `python kernels.py ISA STAGE`.

The binding has no option for Embree's own switch, `isa=`; so a device that was opened with it takes the place of the
binding's in its object.
"""

import ctypes
import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import embreex
import numpy as np
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from spin_usd.basics.arrays import digest
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.renderers.embree import caster as caster_module
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.content_keys import geometry_key
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.processors import numpy_uses_avx2

NATIVE_RAY8_SUPPORTED = 33  # of RTCDeviceProperty: with AVX


def opener(isa: str) -> tuple[Callable[..., EmbreeScene], int]:
    """Return what opens scenes on a device of these kernels, and whether they are of AVX."""
    library = next(Path(embreex.__file__).parent.parent.glob("embreex.libs/libembree4*"))
    embree = ctypes.CDLL(str(library))
    embree.rtcNewDevice.restype, embree.rtcNewDevice.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    embree.rtcGetDeviceProperty.restype = ctypes.c_ssize_t
    embree.rtcGetDeviceProperty.argtypes = [ctypes.c_void_p, ctypes.c_int]
    device = EmbreeDevice()
    assert EmbreeDevice.__basicsize__ == object.__basicsize__ + ctypes.sizeof(ctypes.c_void_p)
    opened = embree.rtcNewDevice(f"isa={isa}".encode())
    ctypes.c_void_p.from_address(id(device) + object.__basicsize__).value = opened
    return partial(EmbreeScene, device), embree.rtcGetDeviceProperty(opened, NATIVE_RAY8_SUPPORTED)


def main(isa: str, stage: str) -> None:
    vars(caster_module)["EmbreeScene"], avx = opener(isa)
    reader, caster, found = StageReader(stage), EmbreeCaster(), {}
    for frame in reader.frames:
        scene = reader.scene(frame, views={"next_frame"})
        surface = visible_surface(scene, caster.visibility(scene), caster)
        labels = {
            name: digest(np.ascontiguousarray(label.make(scene, surface))) for name, label in PIXEL_LABELS.items()
        }
        found[frame.name] = {"key": geometry_key(scene), "pixels": len(surface.z), **labels}
    print(json.dumps({"avx": avx, "numpy_avx2": numpy_uses_avx2(), "labels": found}))


if __name__ == "__main__":
    main(*sys.argv[1:])
