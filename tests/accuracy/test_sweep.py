from collections import Counter

import pytest

from spin_usd.accuracy.sweep import base_effort, representative, settings_to_measure
from spin_usd.scene.effort import Effort


def walk(most=64, several_lights=False, glossy=False, **rest):
    return settings_to_measure(max_samples=most, several_lights=several_lights, glossy=glossy, **rest)


@pytest.mark.parametrize("most", [1, 2, 16, 64, 100, 256])
def test_no_setting_comes_twice_or_takes_more_than_the_most(most) -> None:
    settings = walk(most, several_lights=True, glossy=True)
    assert max(Counter(settings).values()) == 1
    assert max(setting.effort.samples for setting in settings) == most


def test_each_but_samples_and_denoiser_changes_one_thing_of_the_base() -> None:
    base = base_effort(64)
    for setting in walk(several_lights=True, glossy=True):
        effort = setting.effort
        if setting.renderer == "blender" and effort.samples == base.samples:
            changed = [name for name in vars(effort) if getattr(effort, name) != getattr(base, name)]
            assert len(changed) <= 1


def test_the_light_tree_is_of_interest_with_several_lights_only() -> None:
    assert all(setting.effort.light_tree for setting in walk())
    assert not all(setting.effort.light_tree for setting in walk(several_lights=True))


def test_the_glossy_filter_is_of_interest_with_glossy_surfaces_only() -> None:
    assert not any(setting.effort.filter_glossy for setting in walk())
    assert any(setting.effort.filter_glossy for setting in walk(glossy=True))


@pytest.mark.parametrize(("most", "any_adaptive"), [(1, False), (16, False), (17, True), (64, True)])
def test_adaptive_sampling_is_of_interest_where_it_can_stop_early(most, any_adaptive) -> None:
    assert any(setting.effort.adaptive for setting in walk(most)) == any_adaptive


def test_other_settings_are_measured_too_unless_they_take_too_many_samples() -> None:
    few, many = Effort(samples=8, denoiser="high"), Effort(samples=4096)
    found = [setting.effort for setting in walk(others=[few, many])]
    assert few in found
    assert many not in found


def test_representative_pictures_are_small_median_and_large() -> None:
    pixels = {10: 500, 11: 0, 12: 100, 13: 300, 14: 0}
    assert representative(pixels, 3) == [10, 12, 13]
    assert representative(pixels, 1) == [13]
    assert representative(pixels, 9) == [10, 12, 13]


def test_representative_pictures_are_from_all_sizes_and_always_the_same() -> None:
    pixels = {i: (7 * i) % 100 + 1 for i in range(100)}
    found = representative(pixels, 3)
    assert sorted(pixels[i] for i in found) == [17, 51, 84]
    assert representative(dict(reversed(pixels.items())), 3) == found


def test_there_may_be_no_picture_to_measure() -> None:
    assert representative({0: 0}, 3) == []
