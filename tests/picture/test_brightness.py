"""Pictures that show nothing are counted when they are made, and named by check, with what would cure them."""

import json
import re

import pytest

from spin_usd.picture.brightness import BLACK, EXPOSURE_END, WHITE, tone_findings
from tests.cases.records import record_saying, records_of

# A cube face to face with camera and Sun: as it should be, in the dark and in the glare, then the last two with an
# auto-exposure of one stop either way.
STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    metersPerUnit = 1
    startTimeCode = 0
    endTimeCode = 4
)

def Xform "World"
{
    def Camera "Camera" (
        prepend apiSchemas = ["SpinLensAPI", "SpinSensorAPI"]
    )
    {
        int2 spin:lens:imageSize = (64, 48)
        double spin:lens:fx = 80
        double spin:lens:fy = 80
        double spin:lens:cx = 32
        double spin:lens:cy = 24
        float exposure.timeSamples = { 0: 0, 1: -15, 2: 15, 3: -15, 4: 15 }
        bool spin:sensor:autoExposure.timeSamples = { 0: 0, 3: 1 }
        double2 spin:sensor:autoExposure:stops = (-1, 1)
    }

    def DistantLight "Sun"
    {
        float inputs:intensity = 10
        bool inputs:normalize = 1
    }

    def Xform "Target" (
        prepend apiSchemas = ["SpinTargetAPI"]
    )
    {
        double3 xformOp:translate = (0, 0, -6)
        uniform token[] xformOpOrder = ["xformOp:translate"]

        def Cube "Box"
        {
        }
    }
}
"""
FAULTS = {BLACK: 2, WHITE: 2, EXPOSURE_END: 2}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory, spin_usd):
    folder = tmp_path_factory.mktemp("tones")
    (folder / "dataset.usda").write_text(STAGE)
    made = render(spin_usd, folder / "dataset.usda", folder / "dataset")
    assert json.loads(made.stdout)["faults"] == FAULTS
    return folder / "dataset"


def render(spin_usd, stage, out, *more):
    return spin_usd("render", stage, "--out", out, "--renderer", "raycast", "--json", *more)


def test_what_the_records_say(dataset) -> None:
    tones = [record["tones"] for record in records_of(dataset)]
    assert len({each["pixels"] for each in tones}) == 1
    assert [(each["dark"], each["saturated"], each.get("exposure_end")) for each in tones] == [
        (0, 0, None),
        (1, 0, None),
        (0, 1, None),
        (1, 0, "longest"),
        (0, 1, "shortest"),
    ]


def test_pictures_that_were_there_count_too(dataset, spin_usd) -> None:
    again = json.loads(render(spin_usd, dataset.parent / "dataset.usda", dataset).stdout)
    assert (again["made"], again["reused"], again["faults"]) == (0, 5, FAULTS)


def test_check_names_them_and_what_to_do(dataset, spin_usd) -> None:
    found = json.loads(spin_usd("check", dataset, "--json").stdout)["findings"]
    assert {finding["severity"] for finding in found} == {"warning"}
    named = {(finding["where"][-11:-5], finding["code"]) for finding in found}
    assert named >= {
        ("000001", "nearly-black"),
        ("000002", "nearly-white"),
        ("000003", "nearly-black"),
        ("000003", "exposure-end"),
        ("000004", "nearly-white"),
        ("000004", "exposure-end"),
    }
    assert not [where for where, _ in named if where == "000000"]
    assert all("exposure.stops" in each["message"] for each in found if each["where"].startswith("records/"))


def test_render_says_so_in_a_sentence(dataset, spin_usd) -> None:
    stage = dataset.parent / "dataset.usda"
    said = spin_usd("render", stage, "--out", dataset, "--renderer", "raycast").stderr
    expected = f"2 of 5 nearly black, 2 of 5 nearly white, 2 of 5 at an end of auto-exposure; spin-usd check {dataset}"
    assert expected in said


def test_the_demo_says_so_too(tmp_path, spin_usd) -> None:
    """Of a stage that stands where its own would."""
    (tmp_path / "stage").mkdir()
    (tmp_path / "stage" / "dataset.usda").write_text(STAGE.replace("endTimeCode = 4", "endTimeCode = 1"))
    said = spin_usd("demo", "--out", tmp_path, "--workers", 1).stderr
    assert f"warning: 1 of 2 nearly black; spin-usd check {tmp_path / 'dataset'} names them" in said


@pytest.mark.parametrize(
    ("sun", "do"),
    [
        ({"towards_cam": [0, 0, 1], "obscured": 0}, "the Sun is 180 degrees from the camera.*target_lit_deg"),
        ({"towards_cam": [0, 0, -1], "obscured": 1}, "a planet hides the Sun.*limb_from_sun_deg"),
        ({"towards_cam": [0, 0, -1], "obscured": 0}, r"raise the light or the exposure \(exposure.stops\)"),
        (None, "there is no distant light"),
    ],
)
def test_the_remedy_of_a_black_picture_is_that_of_its_light(sun, do) -> None:
    tones = {"pixels": 9, "mean": 0.01, "dark": 0.9, "saturated": 0}
    lit = {"sun": {**sun, "towards_body": [0, 0, 1]}} if sun else {}
    (finding,) = tone_findings(record_saying(tones=tones, **lit), "records/nominal/a.json")
    assert re.search(do, finding.message)
