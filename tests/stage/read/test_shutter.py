"""The shutter and the aperture, as the stage gives them, against formulas for a target that moves as authored."""

import numpy as np
import pytest

from spin_usd.errors import StageError
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings, geometry_key
from spin_usd.scene.effort import Effort
from spin_usd.stage.read.stage_reader import StageReader

CODES = 24.0  # time codes per second, USD's fallback
SHARP_M = 1e-9  # rounding of doubles at 10 m
TURN = np.radians(40)  # between the two time samples
COSINE, SINE = float(np.cos(TURN / 2)), float(np.sin(TURN / 2))
MOVING = f"""
double3 xformOp:translate.timeSamples = {{ 0: (0, 0, -10), 8: (4, 0, -10) }}
quatd xformOp:orient.timeSamples = {{ 0: (1, 0, 0, 0), 8: ({COSINE!r}, 0, 0, {SINE!r}) }}
uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]
"""
RANGE = "metersPerUnit = 1\nstartTimeCode = 0\nendTimeCode = 8"
APIS = ("SpinLensAPI", "SpinShutterAPI")


@pytest.fixture
def reader(make_stage):
    """A reader of a stage with the `camera`'s attributes, moving at 0.5 m and 5 degrees per time code."""

    def read(camera="", metadata=RANGE, pose=MOVING, **options):
        return StageReader(make_stage(camera=camera, apis=APIS, metadata=metadata, pose=pose, **options))

    return read


def at(reader, time_code):
    """The picture at a whole time code."""
    return reader.scene(reader.frames[time_code])


def places(scene):
    return np.array([pose.translation[0] for pose in scene.bodies[0].poses])


def shutter_text(opens, closes, readout=None) -> str:
    rolling = "" if readout is None else f"\ndouble spin:shutter:readoutTime = {readout!r}"
    return f"double shutter:open = {opens!r}\ndouble shutter:close = {closes!r}{rolling}"


def test_usds_fallback_is_an_instant_and_a_pinhole(reader) -> None:
    scene = at(reader(), 4)
    assert scene.shutter is None
    assert scene.thin_lens is None
    assert np.isclose(scene.bodies[0].T_cam_body.translation[0], 2.0, atol=SHARP_M)


def test_poses_follow_the_trajectory_over_the_exposure(reader) -> None:
    """The n-th pose is that of the n-th time, straight from the formula of the motion."""
    scene = at(reader(shutter_text(-0.25, 0.75)), 4)
    times = np.linspace(3.75, 4.75, len(scene.bodies[0].poses))
    assert np.allclose(places(scene), times / 2, atol=SHARP_M)
    turns = [np.arctan2(-pose.rotation[1, 0], pose.rotation[0, 0]) for pose in scene.bodies[0].poses]
    assert np.allclose(turns, times * TURN / 8, atol=1e-12)  # `cam` looks against the axis
    assert scene.shutter.readout == 0


def test_labels_are_those_of_a_still_stage_at_the_middle(reader) -> None:
    blurred, still = at(reader(shutter_text(0.0, 2.0)), 3), at(reader(name="still.usda"), 4)
    assert np.array_equal(blurred.bodies[0].T_cam_body.matrix, still.bodies[0].T_cam_body.matrix)
    assert geometry_key(blurred) == geometry_key(still)
    settings = RenderSettings(renderer="blender", effort=Effort(samples=1), seed=0)
    assert KeyMaker(settings).keys(blurred).radiance != KeyMaker(settings).keys(still).radiance
    assert blurred.frame.time_code == 3  # the picture keeps its own time code


@pytest.mark.parametrize(("opens", "closes", "share"), [(-0.5, 0.5, 0.5), (0.25, 0.25, 1.0), (-1.5, 1.5, 0.25)])
def test_rolling_shutter_spreads_about_the_middle_row(reader, opens, closes, share) -> None:
    scene = at(reader(shutter_text(opens, closes, readout=1 / CODES)), 4)  # one time code
    middle = 4 + (opens + closes) / 2
    half = (closes - opens + 1) / 2
    assert np.allclose(places(scene)[[0, -1]], np.array([middle - half, middle + half]) / 2, atol=SHARP_M)
    assert np.isclose(scene.shutter.readout, share, rtol=1e-12)
    assert np.isclose(scene.bodies[0].T_cam_body.translation[0], middle / 2, atol=SHARP_M)


def test_poses_rest_before_the_first_time_sample(reader) -> None:
    found = places(at(reader(shutter_text(-1.0, 1.0)), 0))
    assert np.allclose(found, np.maximum(np.linspace(-1, 1, len(found)), 0) / 2, atol=SHARP_M)


def test_a_camera_that_moves_blurs_too(reader) -> None:
    camera = "double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 8: (8, 0, 0) }\n"
    camera += 'uniform token[] xformOpOrder = ["xformOp:translate"]\n' + shutter_text(0.0, 1.0)
    still = 'double3 xformOp:translate = (0, 0, -10)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    found = places(at(reader(camera, pose=still), 2))
    assert np.allclose(found, -np.linspace(2, 3, len(found)), atol=SHARP_M)


def test_fast_turns_get_more_poses_until_they_cannot_be_followed(reader) -> None:
    assert len(at(reader(shutter_text(-1.0, 1.0)), 4).bodies[0].poses) == 9
    assert len(at(reader(shutter_text(-3.0, 3.0)), 4).bodies[0].poses) == 9  # 30 degrees in eight steps
    spin = ", ".join(f"{t}: ({int(t % 2 == 0)}, 0, 0, {int(t % 2)})" for t in range(9))  # half a turn per time code
    half_turns = f'quatd xformOp:orient.timeSamples = {{ {spin} }}\nuniform token[] xformOpOrder = ["xformOp:orient"]'
    pushed = half_turns.replace('["', '["xformOp:translate", "')
    pushed = "double3 xformOp:translate = (0, 0, -10)\n" + pushed
    assert len(at(reader(shutter_text(-0.5, 0.5), pose=pushed, name="half.usda"), 4).bodies[0].poses) == 65
    with pytest.raises(StageError, match="turns by more than 5 degrees"):
        at(reader(shutter_text(-4.0, 4.0), pose=pushed, name="full.usda"), 4)


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        (shutter_text(1.0, 0.0), "opens at 1 and closes at 0"),
        (shutter_text(0.0, 0.0, readout=-1.0), "readoutTime"),
        (shutter_text(0.0, 0.0, readout=1e30), "readoutTime: is 1e[+]30; choose numbers from 0 to 1e[+]06"),
        (shutter_text(0.0, 1e300), "shutter:close: is 1e[+]300; choose"),
        ("float fStop = -1", "fStop: is -1.0; choose 0, or numbers from 0.1 to 1e[+]06"),
        ("float fStop = 1e-30", "fStop: is"),
        ("float fStop = 2\nfloat focusDistance = 4", "no focalLength"),
        ("float fStop = 2\nfloat focalLength = 20", "focusDistance 0"),
    ],
)
def test_what_is_no_exposure_or_aperture_is_refused_by_name(reader, camera, message) -> None:
    opened = reader(camera)
    with pytest.raises(StageError, match=message) as caught:
        at(opened, 0)
    assert "/World/Camera" in str(caught.value)


def test_a_readout_without_its_api_is_not_ignored(make_stage) -> None:
    opened = StageReader(make_stage(camera="double spin:shutter:readoutTime = 0.02"))
    with pytest.raises(StageError, match="readoutTime: is authored, but SpinShutterAPI is not applied"):
        at(opened, 0)


@pytest.mark.parametrize("metres", [1.0, 0.01])
def test_aperture_and_focus_in_metres_whatever_the_unit(reader, metres) -> None:
    """An f/2 lens of 50 mm has an aperture of 25 mm across. USD's focal length is in tenths of a unit."""
    focal, focus = 0.050 / metres * 10, 3.0 / metres
    camera = f"float fStop = 2\nfloat focalLength = {focal}\nfloat focusDistance = {focus}\nfloat exposure:fStop = 11"
    lens = at(reader(camera, metadata=RANGE.replace("= 1", f"= {metres}")), 0).thin_lens
    assert np.isclose(lens.radius, 0.0125, rtol=1e-6)  # USD keeps single precision
    assert np.isclose(lens.focus, 3.0, rtol=1e-6)
