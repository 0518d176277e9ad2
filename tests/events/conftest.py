"""One moving craft for the tests of its events."""

from functools import partial

import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.events.event_stage import EventStage
from spin_usd.events.light_frames import LightFrames, rendered
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.processes.open_renderer import open_renderer
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.scene.event_sensor import EventSensor
from tests.cases.moving import SECONDS, author_moving

SETTINGS = RenderSettings(renderer="raycast", effort=Effort(samples=64), seed=0)


class Moving:
    """The stage, its scenes at any time, and the frames of light that are made of them."""

    def __init__(self, root) -> None:
        stage = EventStage(root, variant="nominal", pictures=range(len(SECONDS)))
        self.root, self.pictures = root, SECONDS
        self.at = partial(stage.scene, no_progress)
        self.steps = stage.times(no_progress)
        caster = EmbreeCaster()
        self.maker = PassMaker(caster, open_renderer("raycast", caster=caster))

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
def still(tmp_path_factory):
    return Moving(author_moving(tmp_path_factory.mktemp("still") / "still", rate=0, speed=0))


@pytest.fixture(scope="session")
def moving(tmp_path_factory):
    return Moving(author_moving(tmp_path_factory.mktemp("events") / "moving"))
