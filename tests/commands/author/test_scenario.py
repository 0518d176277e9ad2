"""Scenarios: what their stages hold against other libraries, and what their pictures show."""

import json
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
import tetra3rs
from pxr import Usd
from skyfield.api import EarthSatellite, wgs84

from spin_usd import Dataset, SpinError, author, render
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError, MissingPackageError
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.orbits.epochs import Epochs
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader
from tests.orbits.test_orbits import ISS, checksum

ARCSECOND = np.pi / 648000
CAMERA = "posebowl"
HEAD = """epoch = "{epoch}"
{times}
stars = {stars}
[target.orbit]
kind = "keplerian"
semi_major_axis_m = 7078137
inclination_deg = 98.2
node_deg = 10
mean_anomaly_deg = {anomaly}
[target.attitude]
kind = "tumbling"
q = [0.6, 0.8, 0, 0]
rate_deg_s = [0.3, 1.0, -0.5]
inertia_kg_m2 = [20, 30, 40]
[chaser.orbit]
kind = "relative_state"
place_m = {place}
{rest}
"""


def scenario(
    folder: Path,
    *,
    epoch: str = "2024-03-20T10:00:00Z",
    times: str = "duration_s = 60\nstep_s = 10",
    stars: float = -3,
    anomaly: float = 60,
    place: str = "[0, -20, 1]",
    rest: str = "",
) -> Path:
    file = folder / "scenario.toml"
    text = HEAD.format(epoch=epoch, times=times, stars=stars, anomaly=anomaly, place=place, rest=rest)
    file.write_text(text)
    return file


def stage_of(folder: Path, file: Path, **options) -> Path:
    given = {"target": "cubesat", "camera": CAMERA, "resolution": "160"} | options
    return Path(author_stage(scenario=file, out=folder / "stage", **given).root)


def pointing(at: str, towards: str = "[0.1, 0.3, 0.9]") -> str:
    return f'[chaser.attitude]\nkind = "pointing"\nat = {at}\ntowards = {towards}'


def turn_between(a, b):
    off = (a @ b.T - b @ a.T) / 2
    return float(np.linalg.norm([off[2, 1], off[0, 2], off[1, 0]]))


def test_a_stage_has_times_rates_and_the_earth_below(tmp_path: Path) -> None:
    root = stage_of(tmp_path, scenario(tmp_path))
    reader = StageReader(root)
    assert [frame.time_s for frame in reader.frames] == [0, 10, 20, 30, 40, 50, 60]
    assert reader.frames[3].utc == "2024-03-20T10:00:30Z"
    assert Usd.Stage.Open(str(root)).GetTimeCodesPerSecond() == pytest.approx(0.1)
    scenes = [reader.scene(frame) for frame in reader.frames]
    for before, after in pairwise(scenes):
        middle = (before.bodies[0].motion.velocity + after.bodies[0].motion.velocity) / 2
        moved = after.bodies[0].T_cam_body.translation - before.bodies[0].T_cam_body.translation
        assert middle == pytest.approx(moved / 10, abs=2e-5)  # of a trapezium's rule
    earth, moon = scenes[0].environment.planets
    place = earth.T_cam_planet.translation
    assert np.linalg.norm(place) == pytest.approx(7078137, abs=30)
    assert abs(place[0]) < 1e3  # the chaser's second axis, the camera's down, looks towards the Earth
    assert place[1] > 7e6
    assert 3.5e8 < np.linalg.norm(moon.T_cam_planet.translation) < 4.2e8
    assert scenes[0].bodies[0].T_cam_body.translation == pytest.approx([0, 0, np.hypot(20, 1)], abs=1e-6)
    assert not [found for found in check_stage(root) if found.severity == "error"]


def test_the_camera_stands_where_it_is_mounted(tmp_path: Path) -> None:
    file = scenario(tmp_path, rest="[camera]\nq = [0, 1, 0, 0]\nplace_m = [0, 0, 3]\n" + pointing('"target"'))
    file.write_text(
        file.read_text().replace("[target.attitude]", "[target]\ncentre_of_mass_m = [0, 0, 0]\n[target.attitude]")
    )
    reader = StageReader(stage_of(tmp_path, file))
    away = reader.scene(reader.frames[0]).bodies[0].T_cam_body.translation
    assert away == pytest.approx([0, 0, -(np.hypot(20, 1) - 3)], abs=1e-6)  # half a turn about x: it looks back


def test_the_shadow_of_the_earth_begins_when_another_library_has_it(tmp_path: Path, timescale, de421) -> None:
    """Skyfield takes the Sun for a point and the Earth for a ball of the equator's radius, which is up to 21 km, some
    seconds, more than the Earth's own limb."""
    lines = [checksum(f"{line:<69}") for line in ISS.splitlines()[1:]]
    craft = EarthSatellite(*lines, ts=timescale)
    fine = np.arange(0, 5500, 0.5)
    tt = Epochs("2024-05-01T12:00:00Z", fine).time.tt
    sunlit = craft.at(timescale.tt_jd(tt.jd1, tt.jd2)).is_sunlit(de421)
    # One of ten times, and every one where light changes: 1,100 pictures take four seconds to author and read.
    seconds = np.arange(0, 5500 + 1, 5)
    near = np.abs(fine[1:][np.diff(sunlit)] - seconds[:, None]).min(1) < 50
    seconds = seconds[near | (seconds % 50 == 0)]
    (tmp_path / "iss.tle").write_text("\n".join(lines))
    orbit = '[target.orbit]\nkind = "tle"\nfile = "iss.tle"\n'
    file = scenario(tmp_path, epoch="2024-05-01T12:00:00Z", times=f"times_s = {seconds.tolist()}")
    text = file.read_text()
    file.write_text(text[: text.index("[target.orbit]")] + orbit + text[text.index("[target.attitude]") :])
    reader = StageReader(stage_of(tmp_path, file))
    shares = np.array([reader.scene(frame).lights[0].obscuration for frame in reader.frames])
    for sign in (1, -1):
        known = fine[1:][np.diff(sunlit.astype(int)) == -sign]
        crossed = np.flatnonzero(np.diff((shares > 0.5).astype(int)) == sign)
        at = seconds[crossed] + 5 * (0.5 - shares[crossed]) / (shares[crossed + 1] - shares[crossed])
        assert len(known) == len(at) == 1
        assert at == pytest.approx(known, abs=8)
    penumbra = np.count_nonzero((shares > 0) & (shares < 1)) * 5
    assert 10 <= penumbra <= 30  # both: the Sun's 0.53 degrees at some 0.065 degrees a second


@pytest.mark.parametrize("epoch", ["2010-06-21T06:00:00Z", "2018-12-01T11:30:00Z", "2024-03-20T12:30:00Z"])
def test_land_and_light_of_the_earth_are_where_they_must_be(tmp_path: Path, timescale, de421, epoch: str) -> None:
    """A map that is grey but for a white patch shows where a place is, and where the day ends; Skyfield says both."""
    latitude, longitude = 12.0, 41.0
    maps = tmp_path / "maps"
    maps.mkdir()
    ground, clouds = np.full((512, 1024), 60, np.uint8), np.zeros((512, 1024), np.uint8)
    row, column = round((90 - latitude) / 180 * 512), round((longitude + 180) / 360 * 1024)
    ground[row - 6 : row + 6, column - 6 : column + 6] = 255
    cv2.imwrite(str(maps / "ground.png"), ground)
    cv2.imwrite(str(maps / "clouds.png"), clouds)
    time = timescale.utc(*map(int, epoch[:10].split("-")), *map(int, epoch[11:19].split(":")))
    patch = wgs84.latlon(latitude, longitude).at(time).position.m
    sun = (de421["sun"] - de421["earth"]).at(time).position.m
    towards_sun = sun / np.linalg.norm(sun)
    across = np.cross(patch, towards_sun)
    place = (patch / np.linalg.norm(patch) + 0.7 * across / np.linalg.norm(across)) * 8e7
    file = scenario(tmp_path, epoch=epoch, times="times_s = [0]", rest=pointing(str((-place).tolist())))
    text = file.read_text()
    orbits = '[target.orbit]\nkind = "relative_state"\nplace_m = [0, 0, 900]\n'
    chaser = f'[chaser.orbit]\nkind = "state"\nplace_m = {place.tolist()}\nvelocity_m_s = [0, 800, 800]\n'
    attitudes = text[text.index("[target.attitude]") : text.index("[chaser.orbit]")], text[text.index("[chaser.at") :]
    file.write_text(text[: text.index("[target.orbit]")] + orbits + attitudes[0] + chaser + attitudes[1])
    root = stage_of(tmp_path, file, camera="speedplus", resolution="480x300", earth=maps)
    stage = Usd.Stage.Open(str(root))
    stage.GetPrimAtPath("/World/Camera").GetAttribute("spin:sensor:encoding").Set("linear")
    stage.GetRootLayer().Save()
    render(stage=root, out=tmp_path / "set", labels="none", renderer="raycast", samples=1)
    reader = StageReader(root)
    scene = reader.scene(reader.frames[0])
    image = Dataset(tmp_path / "set")[0].image.astype(np.float64)
    R_cam_gcrf = scene.environment.planets[0].T_cam_planet.rotation @ Epochs(epoch, np.zeros(1)).R_gcrf_itrf[0].T
    lit = patch @ towards_sun / np.linalg.norm(patch)
    assert lit > 0.2
    (u, v) = scene.camera.project(np.array([R_cam_gcrf @ (patch - place)]))[0]
    near = image[int(v) - 8 : int(v) + 9, int(u) - 8 : int(u) + 9]
    bright = np.argwhere(near > 0.6 * near.max()).mean(0) + 0.5
    assert bright + np.array([int(v) - 8, int(u) - 8]) == pytest.approx(np.array([v, u]), abs=0.6)
    rays = scene.camera.rays(np.stack(np.meshgrid(np.arange(480) + 0.5, np.arange(300) + 0.5), -1).reshape(-1, 2))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    along, centre = -(rays @ R_cam_gcrf) @ place, place @ place - 6.371e6**2
    meets = along**2 > centre + 2e11  # within the limb
    met = place + (along - np.sqrt(np.maximum(along**2 - centre, 0)))[:, None] * (rays @ R_cam_gcrf)
    height = met @ towards_sun / 6.371e6
    light = image.ravel() - np.median(image)
    day, night = meets & (height > 0.15), meets & (height < -0.1)
    assert min(day.sum(), night.sum()) > 300
    assert (light[night] < 0.05 * light.max()).mean() > 0.99
    assert (light[day] > 0.05 * light.max()).mean() > 0.97


@pytest.mark.slow
@pytest.mark.parametrize("at", ['"zenith"', '"orbit_normal"', "[-0.9, 0.1, 0.3]"])
def test_a_star_picture_is_solved_without_a_hint(tmp_path: Path, at: str) -> None:
    """Through the distorted lens of SPEED+, by the solver's own catalogue and patterns."""
    file = scenario(tmp_path, times="times_s = [0]", stars=7.5, place="[0, 0, 2000]", rest=pointing(at))
    root = stage_of(tmp_path, file, camera="speedplus", resolution=None)
    stage = Usd.Stage.Open(str(root))
    camera = stage.GetPrimAtPath("/World/Camera")
    camera.GetAttribute("exposure").Set(16.0)
    camera.GetAttribute("spin:sensor:encoding").Set("linear")
    camera.GetAttribute("spin:sensor:bitDepth").Set(16)
    stage.GetRootLayer().Save()
    render(stage=root, out=tmp_path / "set", labels="none")
    picture = Dataset(tmp_path / "set")[0]
    places, counts = spots(picture.image)
    matrix, lens = np.array(picture.camera_matrix), np.array(picture.distortion)
    straight = cv2.undistortPoints(places.reshape(-1, 1, 2), matrix, lens).reshape(-1, 2)
    width, focal = picture.camera.width, picture.camera.fx
    known = tetra3rs.SolverDatabase.generate_from_gaia(
        max_fov_deg=40.0, min_fov_deg=30.0, epoch_proper_motion_year=2024.2
    )
    fov = float(np.degrees(2 * np.arctan(width / 2 / focal)))
    size = {"image_width": width, "image_height": picture.camera.height}
    solved = known.solve_from_centroids(np.c_[straight * focal, counts], fov_estimate_deg=fov, **size)
    assert solved is not None
    reader = StageReader(root)
    stars = reader.scene(reader.frames[0]).environment.stars[0]
    off = turn_between(np.array(solved.rotation_matrix_icrs_to_camera, np.float64), stars.T_cam_sky.rotation)
    assert off < 10 * ARCSECOND
    matched = zip(solved.matched_catalog_ids, solved.matched_centroids, strict=True)
    pairs = np.array([(known.get_star_by_id(star).magnitude, counts[spot]) for star, spot in matched])
    faint = pairs[(pairs[:, 1] < 0.2 * pairs[:, 1].max())]
    zero = faint[:, 0] + 2.5 * np.log10(faint[:, 1])
    assert np.median(np.abs(zero - np.median(zero))) < 0.03  # magnitudes: the noise of the detector


def spots(image):
    """Places (N, 2) and counts (N,) of spots in a picture."""
    light = image.astype(np.float64) - np.median(image)
    _, label, found, _ = cv2.connectedComponentsWithStats((light > 50).astype(np.uint8), connectivity=8)
    v, u = np.indices(image.shape) + 0.5
    of = label.ravel()
    counts = np.bincount(of, light.ravel())
    places = np.stack([np.bincount(of, (light * each).ravel()) / np.maximum(counts, 1e-9) for each in (u, v)], -1)
    large = np.flatnonzero(found[:, cv2.CC_STAT_AREA] >= 3)[1:]
    return places[large], counts[large]


def test_what_is_chosen_of_it_is_the_same(tmp_path: Path) -> None:
    whole = stage_of(tmp_path, scenario(tmp_path))
    (tmp_path / "some").mkdir()
    some = stage_of(tmp_path / "some", scenario(tmp_path), frames="2:5:2")
    every, chosen = StageReader(whole), StageReader(some)
    assert [frame.name for frame in chosen.frames] == ["img000003", "img000005"]
    for index, frame in enumerate(chosen.frames):
        a, b = every.scene(every.frames[2 + 2 * index]), chosen.scene(frame)
        assert a.bodies[0].T_cam_body.matrix == pytest.approx(b.bodies[0].T_cam_body.matrix)
        assert a.lights[0].direction_cam == b.lights[0].direction_cam
        assert frame.time_s == 20 + 20 * index


def test_the_note_is_of_the_pictures_that_are_chosen(tmp_path: Path) -> None:
    file = scenario(tmp_path, times="duration_s = 600\nstep_s = 10")
    notes = []
    for frames in (None, "0:60:20"):
        (tmp_path / str(frames)).mkdir()
        made = author_stage(
            scenario=file, target="cubesat", camera=CAMERA, out=tmp_path / str(frames) / "stage", frames=frames
        )
        notes.append(next(note for note in made.notes if note.startswith("between pictures")))
    degrees = [float(note.rpartition(" and ")[2].split()[0]) for note in notes]
    assert degrees[0] < 0.1 < degrees[1]


def test_a_craft_beside_a_tle_stays_there(tmp_path: Path) -> None:
    """It is propagated by other forces than the TLE's: what these do to the target they do to it."""
    lines = [checksum(f"{line:<69}") for line in ISS.splitlines()[1:]]
    (tmp_path / "iss.tle").write_text("\n".join(lines))
    attitude = '[chaser.attitude]\nkind = "inertial"\nq = [1, 0, 0, 0]'
    times = "duration_s = 3000\nstep_s = 500"
    file = scenario(tmp_path, epoch="2024-05-01T12:00:00Z", times=times, place="[0, 0, 0]", rest=attitude)
    text = file.read_text()
    orbit = '[target.orbit]\nkind = "tle"\nfile = "iss.tle"\n'
    file.write_text(text[: text.index("[target.orbit]")] + orbit + text[text.index("[target.attitude]") :])
    reader = StageReader(stage_of(tmp_path, file, any_size=True))
    away = [np.linalg.norm(reader.scene(frame).bodies[0].T_cam_body.translation) for frame in reader.frames]
    assert max(away) < 1e-3


def test_variants_and_the_sun_of_a_user_beat_it(tmp_path: Path) -> None:
    root = stage_of(tmp_path, scenario(tmp_path), sun_direction=(0, 0, -1), augment="relight")
    reader = StageReader(root)
    assert reader.scene(reader.frames[0]).lights[0].direction_cam == pytest.approx((0, 0, 1), abs=1e-8)
    assert len(reader.variants) > 1


def test_years_without_predictions_are_told(tmp_path: Path) -> None:
    file = scenario(tmp_path, epoch="2080-01-01T00:00:00Z", times="times_s = [0]")
    made = author_stage(scenario=file, out=tmp_path / "stage", target="cubesat", camera=CAMERA, resolution="160")
    assert any("no prediction of the Earth's rotation" in note for note in made.notes)


def test_pictures_that_go_back_have_no_times_and_a_note(tmp_path: Path) -> None:
    made = author_stage(
        scenario=scenario(tmp_path), target="cubesat", camera=CAMERA, out=tmp_path / "stage", frames="::-1"
    )
    assert "the pictures go back in time, so they have no times" in made.notes
    assert [frame.time_s for frame in StageReader(Path(made.root)).frames] == [None] * 7


def test_a_date_of_toml_is_an_epoch(tmp_path: Path) -> None:
    file = scenario(tmp_path)
    file.write_text(file.read_text().replace('"2024-03-20T10:00:00Z"', "2024-03-20T10:00:00Z"))
    assert StageReader(stage_of(tmp_path, file)).frames[0].utc == "2024-03-20T10:00:00Z"


def test_records_say_when_and_how_fast(tmp_path: Path) -> None:
    root = stage_of(tmp_path, scenario(tmp_path))
    render(stage=root, out=tmp_path / "set", labels_only=True, frames="0:2")
    picture = Dataset(tmp_path / "set")[1]
    assert (picture.time_s, picture.utc) == (10, "2024-03-20T10:00:10Z")
    turn = matrices_from_quaternions(picture.q_cam_body)
    rate = turn.T @ picture.targets[0].angular_velocity  # in the body's axes, less the camera's own turning
    assert np.degrees(np.linalg.norm(rate)) == pytest.approx(np.linalg.norm([0.3, 1.0, -0.5]), abs=0.1)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (('kind = "relative_state"', 'kind = "orbital"'), "orbital"),
        (("node_deg", "nodes_deg"), "nodes_deg"),
        (("duration_s = 60\nstep_s = 10", "times_s = [0, 5, 5]"), "times_s do not increase"),
        (("duration_s = 60\nstep_s = 10", "duration_s = 60"), "needs either times_s, or duration_s with step_s"),
        (("2024-03-20T10:00:00Z", "tomorrow"), "'tomorrow' is not a UTC time"),
        (
            ("semi_major_axis_m = 7078137", "semi_major_axis_m = 7078.137"),
            "give metres, with the perigee more than 6378 km from the Earth's centre",
        ),
        (
            ('kind = "keplerian"', 'kind = "oem"\nfile = "no.oem"'),
            "there is no 'semi_major_axis_m'; choose among kind, file, object",
        ),
        (("q = [0.6, 0.8, 0, 0]", "q = [1, 1, 0, 0]"), "norm 1.41"),
        (("[20, 30, 40]", "[1, 1, 40]"), "which no body has"),
        (('kind = "tumbling"', 'kind = "spinning"'), "spinning' is not one of aem, list, pointing, inertial, tumbling"),
        (('kind = "keplerian"', 'kind = "kepler"'), "is not one of oem, tle, spice, keplerian, state, relative_state"),
        (("[chaser.orbit]", pointing('"earth"') + "\n[chaser.orbit]"), "points at 'earth'; choose among target, nadir"),
        (("semi_major_axis_m = 7078137", "semi_major_axis_m = 7e9"), "meets the ground, or is too large"),
        (("stars = -3", "stars = 12"), "stars to magnitude 12 are not in the catalogue"),
        (("[0, -20, 1]", "[0, nan, 1]"), "contains nan, which is out of range"),
        (("[0.3, 1.0, -0.5]", "[1e9, 0, 0]"), "rate_deg_s is above 3600; check its unit"),
        (("duration_s = 60\nstep_s = 10", "times_s = [0, 1e8]"), "is propagated for more than 35 days"),
        (("duration_s = 60", "times_s = [0]\nduration_s = 60"), "needs either times_s"),
        (("mean_anomaly_deg = 60", "eccentricity = 0.9"), "meets the ground"),
        (
            ('kind = "relative_state"\nplace_m = [0, -20, 1]', 'kind = "relative_elements"\na_dex_m = 1e8'),
            "relative_elements: do not give an ellipse",
        ),
    ],
)
def test_wrong_scenarios_are_told_and_leave_nothing(tmp_path: Path, change, says: str) -> None:
    file = scenario(tmp_path)
    file.write_text(file.read_text().replace(*change))
    with pytest.raises(InputError, match=says) as told:
        stage_of(tmp_path, file)
    assert str(told.value).startswith(str(file))
    assert str(told.value).count(told.value.found) == 1
    assert not (tmp_path / "stage").exists()


@pytest.mark.parametrize("second", [0, 300])
def test_a_file_beside_a_relative_craft_is_refused_for_its_own_fault(tmp_path: Path, second: int) -> None:
    """Only where second 0 alone is missing, the relative orbit is the reason."""
    lines = [f"2024-03-20T10:0{minute}:00 7000 0 0 0 4 6" for minute in (5, 6)]
    head = "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = 2024-05-01T00:00:00\nORIGINATOR = T\nMETA_START\nOBJECT_NAME = A\n"
    about = "OBJECT_ID = B\nCENTER_NAME = EARTH\nREF_FRAME = GCRF\nTIME_SYSTEM = UTC\n"
    span = "START_TIME = 2024-03-20T10:05:00\nSTOP_TIME = 2024-03-20T10:06:00\nMETA_STOP\n"
    (tmp_path / "a.oem").write_text(head + about + span + "\n".join(lines))
    file = scenario(tmp_path, times=f"times_s = [{second}]")
    text = file.read_text()
    orbit = '[target.orbit]\nkind = "oem"\nfile = "a.oem"\n'
    file.write_text(text[: text.index("[target.orbit]")] + orbit + text[text.index("[target.attitude]") :])
    with pytest.raises(InputError, match="has no state at second 0") as told:
        stage_of(tmp_path, file)
    assert ("relative orbit begins" in str(told.value)) == (second == 300)


@pytest.mark.parametrize("place", ["[20, 0, 0]", "[-20, 0, 0]"])
def test_a_default_attitude_that_cannot_be_is_named_as_not_given(tmp_path: Path, place: str) -> None:
    file = scenario(tmp_path, place=place)
    with pytest.raises(InputError, match=r"chaser: has no attitude, and the default .* at second 0; add"):
        stage_of(tmp_path, file)
    advised = '[chaser.attitude]\nkind = "pointing"\nat = "target"\ntowards = "velocity"'
    stage_of(tmp_path, scenario(tmp_path, place=place, rest=advised))


def test_a_tumble_of_too_many_turns_is_told(tmp_path: Path) -> None:
    """Fast ones, so that the orbits are propagated for minutes and not for weeks."""
    file = scenario(tmp_path, times="times_s = [0, 600]")
    file.write_text(file.read_text().replace("[0.3, 1.0, -0.5]", "[3500, 0, 0]"))
    with pytest.raises(InputError, match="turns more than 5000 times"):
        stage_of(tmp_path, file)


def test_one_source_of_pictures_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(SpinError, match="sample and scenario are given together"):
        author(scenario="rendezvous", sample="range=3 count=1", target="cubesat", camera=CAMERA, out=tmp_path / "a")
    with pytest.raises(SpinError, match="scenario is given without camera"):
        author(scenario="rendezvous", target="cubesat", out=tmp_path / "a")


def test_the_extra_is_named_where_it_lacks(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "astropy.coordinates", None)
    monkeypatch.setitem(__import__("sys").modules, "astropy", None)
    with pytest.raises(MissingPackageError, match="pip install 'astropy>=8'"):
        stage_of(tmp_path, scenario(tmp_path))


def test_the_catalogue_is_credited(tmp_path: Path) -> None:
    root = stage_of(tmp_path, scenario(tmp_path, stars=3))
    texts = [file.read_text() for file in (root.parent / "layers").glob("sampled.usda")]
    assert "CC BY-SA 3.0 IGO" in texts[0]
    assert json.dumps(len(StageReader(root).scene(StageReader(root).frames[0]).environment.stars[0].directions)) > "100"
