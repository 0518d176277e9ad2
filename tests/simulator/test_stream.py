"""`Simulator.stream`: pictures without end, each a function of what it is drawn from and its number."""

import json
from itertools import islice

import numpy as np
import pytest
from PIL import Image

from spin_usd import Dataset, Simulator, SpinError

HOW = {"renderer": "raycast", "samples": 1}
POSES = "range=4..6 inside=1"
SPEC = """schema = "augment-1"
[[augmentation]]
name = "lit"
[augmentation.sample]
"sun.direction" = { distribution = "directions" }
"sun.factor" = { distribution = "log_uniform", low = 0.3, high = 3 }
"optics.psf_sigma" = { distribution = "uniform", low = 0.3, high = 1, unit = "px" }
"background" = { distribution = "choice", folder = "photos" }
[augmentation.constraints]
target_lit_deg = 40
"""
PLAIN = """
[[augmentation]]
name = "plain"
select = { materials = "plain" }
[augmentation.sample]
"sun.from_target" = { distribution = "directions" }
"""


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    folder = tmp_path_factory.mktemp("spec")
    (folder / "photos").mkdir()
    for level in (60, 120):
        Image.new("RGB", (300, 200), (level,) * 3).save(folder / "photos" / f"{level}.png")
    (folder / "spec.toml").write_text(SPEC + PLAIN)
    return folder / "spec.toml"


@pytest.mark.children
def test_the_same_arguments_give_the_same_pictures_whoever_makes_them(small_stage, spec) -> None:
    with Simulator(small_stage, **HOW) as simulator:
        found = [*islice(simulator.stream(POSES, spec, seed=4), 12)]
        (later,) = islice(simulator.stream(POSES, spec, seed=4, start=7), 1)
        np.testing.assert_array_equal(later.image, found[7].image)
        (other,) = islice(simulator.stream(POSES, spec, seed=5, start=7), 1)
        assert not np.array_equal(other.T_cam_body, later.T_cam_body)
        again = simulator.picture(found[3].request)
        np.testing.assert_array_equal(again.image, found[3].image)
        np.testing.assert_array_equal(again.depth, found[3].depth)
    with Simulator(small_stage, workers=2, **HOW) as simulator:
        for place, picture in enumerate(islice(simulator.stream(POSES, spec, seed=4), 12)):
            np.testing.assert_array_equal(picture.image, found[place].image)


def test_what_is_drawn_is_as_the_specifications_say(small_stage, spec) -> None:
    with Simulator(small_stage, labels="segmentation", **HOW) as simulator:
        found = [*islice(simulator.stream(POSES, spec, seed=4), 24)]
    behind: dict[str, list[float]] = {}
    for picture in found:
        at, drawn = picture.T_cam_body[:3, 3], picture.request.values
        assert 4 <= np.linalg.norm(at) <= 6
        mask = picture.segmentation > 0
        assert mask.any()
        assert not mask[[0, -1]].any()
        assert not mask[:, [0, -1]].any()
        if "sun.direction" not in drawn:
            assert ({*drawn}, picture.request.selections) == ({"sun.from_target"}, {"materials": "plain"})
            continue
        assert np.degrees(np.arccos(np.array(drawn["sun.direction"]) @ -at / np.linalg.norm(at))) < 42  # of its middle
        behind.setdefault(drawn["background"].rpartition("/")[2], []).append(np.median(picture.image[~mask]))
    assert behind.keys() == {"60.png", "120.png"}
    assert max(behind["60.png"]) < min(behind["120.png"])
    assert len({picture.request.values.get("sun.factor") for picture in found}) > 8


def test_a_function_draws_poses_too(small_stage) -> None:
    def pose(rng):
        return (1, 0, 0, 0), (0, 0, rng.uniform(4, 9))

    with Simulator(small_stage, **HOW) as simulator:
        found = [*islice(simulator.stream(pose, seed=1), 4)]
        (second,) = islice(simulator.stream(pose, seed=1, start=1), 1)
    assert len({picture.T_cam_body[2, 3] for picture in found}) == 4
    np.testing.assert_array_equal(second.image, found[1].image)


def test_a_function_that_forgets_its_pose_is_refused(small_stage) -> None:
    with Simulator(small_stage, **HOW) as simulator:
        with pytest.raises(SpinError, match="the pose of the target is not a pose"):
            next(simulator.stream(lambda rng: None))
        with pytest.raises(SpinError, match="the pose of the target is not a pose"):
            next(simulator.stream(lambda rng: {}))


def test_the_target_keeps_apart_from_others(spin_usd, tmp_path) -> None:
    spin_usd("author", "--sample", "range=5..6 inside=1 count=1", "--target", "tango", "--also", "cubesat",
             "--camera", "speedplus", "--resolution", "96", "--out", tmp_path / "stage")  # fmt: skip
    with Simulator(tmp_path / "stage", image=False, **HOW) as simulator:
        tango, cubesat = simulator.description.targets
        sizes = [np.linalg.norm(np.subtract(*target.box)) / 2 for target in (tango, cubesat)]
        for picture in islice(simulator.stream("range=5..6 inside=1"), 40):
            a, b = (np.append(np.mean(target.box, 0), 1) for target in (tango, cubesat))
            between = picture.targets[0].T_cam_body @ a - picture.targets[1].T_cam_body @ b
            assert np.linalg.norm(between) > 0.9 * sum(sizes)


def test_a_stream_can_be_logged_and_rendered(small_stage, spec, spin_usd, tmp_path) -> None:
    logged = tmp_path / "logged.toml"
    logged.write_text("\n".join(line for line in SPEC.splitlines() if not line.startswith('"background"')))
    with Simulator(small_stage, log=tmp_path / "log", **HOW) as simulator:
        images = {picture.frame: picture.image for picture in islice(simulator.stream(POSES, logged, seed=4), 5)}
        with pytest.raises(SpinError, match="a log has one selection of variants"):
            [*islice(simulator.stream(POSES, spec, seed=4, start=5), 20)]
    spin_usd("render", tmp_path / "log", "--out", tmp_path / "set", "--renderer", "raycast", "--samples", "1")
    stored = Dataset(tmp_path / "set")
    for name, image in images.items():
        np.testing.assert_array_equal(stored.picture(name).image, image)


@pytest.mark.parametrize(
    ("sampled", "said"),
    [
        ('"sun.2.direction" = { distribution = "directions" }', "sun.2.direction: adds a prim; augment the stage"),
        ('"background" = { distribution = "fixed", value = "earth" }', "background: earth needs a new render"),
        ('"sun.factor" = { distribution = "fixed", value = -1 }', "could be -1"),
    ],
)
def test_what_cannot_be_drawn_is_said(small_stage, tmp_path, sampled, said) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(f'schema = "augment-1"\n[[augmentation]]\nname = "x"\n[augmentation.sample]\n{sampled}\n')
    with Simulator(small_stage, **HOW) as simulator, pytest.raises(SpinError, match=said):
        next(simulator.stream(POSES, spec))


def test_what_is_no_stream_is_said(small_stage, tmp_path) -> None:
    with Simulator(small_stage, **HOW) as simulator:
        with pytest.raises(SpinError, match="samples trajectories"):
            next(simulator.stream("shirt"))
        with pytest.raises(SpinError, match="give 0 or more"):
            simulator.stream(POSES, start=-1)
        with pytest.raises(SpinError, match="there is no"):
            simulator.stream(POSES, "nothing")
        json.dumps(next(simulator.stream(POSES)).record)
