"""The extremes' own label passes and renderers."""

import pytest

from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.raycast.renderer import RaycastRenderer

EMBREE = EmbreeCaster()
RAYCAST = RaycastRenderer(caster=EMBREE)


@pytest.fixture(params=["embree", "blender"])
def label_pass(request):
    """That of every run, and the independent one."""
    return EMBREE if request.param == "embree" else request.getfixturevalue("blender")


@pytest.fixture(params=["raycast", "blender"])
def renderer(request):
    return RAYCAST if request.param == "raycast" else request.getfixturevalue("blender")
