"""One moving craft for the tests of its events."""

from dataclasses import replace

import pytest

from spin_usd.events.light_frames import LightFrames, rendered
from spin_usd.events.time_steps import time_steps
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.processes.open_renderer import open_renderer
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.moving import author_moving

SETTINGS = RenderSettings(renderer="raycast", effort=Effort(samples=64), seed=0)


class Moving:
    """The stage, its scenes at any time, and the frames of light that are made of them."""

    def __init__(self, root) -> None:
        self.root, self.reader = root, StageReader(root)
        self.pictures = [frame.time_s for frame in self.reader.frames]
        self.steps = list(time_steps(self.at, self.pictures))
        caster = EmbreeCaster()
        self.maker = PassMaker(caster, open_renderer("raycast", caster=caster))

    def at(self, seconds):
        """The scene at seconds."""
        code = self.reader.clock.time_code(seconds)
        frame = replace(self.reader.frames[0], name=f"e{seconds:.6f}", time_code=code, time_s=seconds)
        return self.reader.scene(frame, instant=True)

    def frames(self, times, *, settings=SETTINGS, **options):
        """The maker of frames at the times."""
        return LightFrames(
            self.at,
            times,
            self.maker,
            lambda light, fine: rendered(light, fine, self.maker, settings),
            settings,
            EventSensor(),
            **options,
        )


@pytest.fixture(scope="session")
def moving(tmp_path_factory):
    return Moving(author_moving(tmp_path_factory.mktemp("events") / "moving"))
