"""The extremes' own renderers."""

import pytest

from spin_usd.renderers.raycast.renderer import RaycastRenderer

RAYCAST = RaycastRenderer()


@pytest.fixture(params=["raycast", "blender"])
def renderer(request):
    return RAYCAST if request.param == "raycast" else request.getfixturevalue("blender")
