"""The tree of a mesh is built by one thread, for several do not make the same twice; light is rendered by all."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager

import pytest

from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from tests.cases import scenes

SUN = DistantLight(path="/sun", direction_cam=(0.6, 0.0, 0.8), irradiance=(3.0,) * 3)
GLOWING = Material(path="/glowing", emissive_color=(3.0, 2.0, 1.0))
NESTED = """
import json, os
os.sched_setaffinity(0, range(os.cpu_count()))
from spin_usd.renderers.blender.renderer import MOST_THREADS, _library, one_thread
most = lambda: _library()["_ZN3tbb6detail2r127global_control_active_valueEi"](MOST_THREADS)
found = [most()]
with one_thread():
    with one_thread():
        found.append(most())
    found.append(most())
print(json.dumps([*found, most()]), flush=True)
os._exit(0)
"""


@pytest.mark.skipif(os.cpu_count() == 1, reason="needs two processors")
def test_tbb_has_one_thread_until_the_last_hold_ends() -> None:
    done = subprocess.run([sys.executable, "-c", NESTED], stdout=subprocess.PIPE, check=True)
    before, *held, after = json.loads(done.stdout.splitlines()[-1])  # Blender may say where its OCIO is
    assert held == [1, 1]
    assert before == after > 1


@pytest.mark.parametrize(("material", "expected"), [(scenes.GREY, [1, 0, 1, 1]), (GLOWING, [1, 1, 1, 1])])
def test_a_mesh_is_prepared_by_one_thread_once(blender, make_scene, monkeypatch, material, expected) -> None:
    """Again after another, and, where it glows and so is placed anew, for each picture."""
    from spin_usd.renderers.blender import passes, renderer

    held, seen, render = [], [], passes.render

    @contextmanager
    def hold():
        held.append(True)
        yield
        held.clear()

    def watched(*args, **options) -> None:
        seen.append(bool(held))
        render(*args, **options)

    monkeypatch.setattr(renderer, "one_thread", hold)
    monkeypatch.setattr(passes, "render", watched)
    points, faces = scenes.boxes()
    one, other = (
        make_scene(size * points, faces, camera=scenes.SMALL, materials=[material], lights=[SUN]) for size in (1.0, 1.5)
    )
    counts = []
    for scene in (one, one, other, one):
        seen.clear()
        blender.radiance(scene, Effort(samples=1), seed=0)
        counts.append(sum(seen))
        assert not seen[-1]
    assert counts == expected
