"""The first device that can render all pictures is taken, and no other."""

from dataclasses import replace

import pytest

from spin_usd.errors import UnsupportedError
from spin_usd.planning.in_child import chosen_device
from tests.cases.scenes import SMALL, box, pose, scene, target, with_first

PINHOLE = scene(target(*box()), camera=replace(SMALL, distortion=(0.0,) * 5))
DISTORTED = scene(target(*box()))
FAR = with_first(PINHOLE, T_cam_body=pose(t=(0, 0, 400)))


@pytest.mark.parametrize(
    ("offered", "scenes", "taken"),
    [
        (["cuda", "cpu"], [PINHOLE], "cuda"),
        (["cuda", "cpu"], [PINHOLE, DISTORTED], "cpu"),
        (["hip", "cpu"], [FAR], "cpu"),
        (["optix", "cuda", "cpu"], [DISTORTED, FAR], "optix"),
        (["cuda", "optix"], [DISTORTED], "optix"),
    ],
)
def test_auto_takes_the_first_device_that_renders_all_pictures(offered, scenes, taken) -> None:
    assert chosen_device(offered, scenes) == taken


@pytest.mark.parametrize("picture", [DISTORTED, FAR])
def test_a_device_that_is_named_is_refused_by_what_it_cannot_render(picture) -> None:
    with pytest.raises(UnsupportedError, match=r"picture nominal/frame: cannot be rendered on metal.*cpu or optix"):
        chosen_device(["metal"], [PINHOLE, picture])


def test_no_picture_is_read_for_a_device_that_renders_all() -> None:
    assert chosen_device(["cpu"], iter(lambda: pytest.fail("read"), None)) == "cpu"
