"""The settings in records, also of those that were written before there was as much to choose."""

from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.store.recorded_settings import recorded_settings


def test_what_an_older_record_does_not_say_was_the_only_way() -> None:
    effort = {"samples": 16, "adaptive": 0.0, "denoiser": "none", "bounces": 4, "clamp": 0.0, "light_tree": True}
    record = {"provenance": {"render": {"renderer": "blender", "effort": effort}, "seed": {"dataset": 3}}}
    now = RenderSettings(renderer="blender", effort=Effort(samples=16, filter_glossy=0.0), seed=3, device="cpu")
    assert recorded_settings(record) == now
