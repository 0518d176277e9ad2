"""Devices as Cycles has them: none is taken for another, and a proof of one leaves no trace in a picture."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.errors import UnsupportedError
from spin_usd.renderers.blender.cycles_settings import GRAPHICS, LightDevice, graphics_processors
from spin_usd.renderers.device import DEVICES
from spin_usd.scene.effort import CPU, Effort
from spin_usd.scene.light import DistantLight
from tests.cases.scenes import SMALL, box, scene, target

SUN = DistantLight(path="/sun", direction_cam=(0, 0, 1), irradiance=(1, 1, 1))
PINHOLE = replace(SMALL, distortion=(0.0,) * 5)
EFFORT = Effort(samples=2)


def boxed(camera=SMALL):
    return scene(target(*box()), camera=camera, lights=(SUN,))


def test_every_device_that_cycles_has_is_one_of_ours(blender) -> None:
    import bpy

    listed = bpy.context.preferences.addons["cycles"].preferences.get_device_types(bpy.context)
    assert {name.lower() for name, *_ in listed} - {"none"} <= set(DEVICES)


def test_what_is_not_there_is_refused_and_never_replaced(blender) -> None:
    found = graphics_processors()
    assert set(found) <= set(GRAPHICS)
    for name in set(GRAPHICS) - set(found):
        with pytest.raises(UnsupportedError, match=rf"no device {name}; choose --device .*cpu"):
            LightDevice(name)


def test_a_device_that_sees_nothing_is_refused() -> None:
    seen, device = np.ones((20, 20), np.float32), LightDevice(CPU)
    device.prove(seen, seen)
    with pytest.raises(UnsupportedError, match="400 pixels differ"):
        device.prove(seen, np.zeros_like(seen))


class TestTheProcessorUnderAnotherName:
    """What can be known of devices on a machine without one: this one is the CPU, and must be proven."""

    @pytest.fixture
    def renderer(self, blender, monkeypatch):
        monkeypatch.setattr("spin_usd.renderers.blender.cycles_settings._use", lambda name: "a model")
        device = LightDevice("cuda")
        device.cycles = {"device": "CPU"}  # Cycles has no other here
        monkeypatch.setattr(blender, "_device", device)
        return blender

    def test_its_pictures_have_the_bytes_of_pictures_without_a_proof(self, renderer, monkeypatch) -> None:
        plain = boxed(PINHOLE)
        first = renderer.radiance(plain, EFFORT, seed=3)
        again = renderer.radiance(plain, EFFORT, seed=3)
        assert renderer.versions()["cuda"] == "a model"
        monkeypatch.setattr(renderer, "_device", LightDevice(CPU))
        wanted = renderer.radiance(plain, EFFORT, seed=3)
        for made in (first, again):
            assert np.array_equal(made.groups, wanted.groups)
            assert np.array_equal(made.coverage, wanted.coverage)
        assert wanted.coverage.any()

    def test_it_refuses_a_lens_that_its_kind_cannot_render(self, renderer) -> None:
        with pytest.raises(UnsupportedError, match=r"cannot be rendered on cuda.*choose --device cpu or optix"):
            renderer.radiance(boxed(), EFFORT, seed=3)
