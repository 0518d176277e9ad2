"""`spin-usd gap`: sets that differ in their seed alone have no gap, and planted camera and light are found."""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from msgspec import UNSET

import spin_usd
from spin_usd.commands.gap import pair_measures
from spin_usd.commands.gap.report import GapMeasure, GapReport
from spin_usd.realism.darkness import darkness
from spin_usd.realism.picture_view import PictureView
from spin_usd.realism.signals import correlation
from spin_usd.realism.two_sample import patch_features
from tests.commands.gap.conftest import FRAMES, LEVEL, NOISE, PER_STEP, PSF, SHOT, STEPS, plant
from tests.conftest import speedplus_camera

NO_GAP = 0.02
"""Of a measure's own size: what passes for none where an interval of six pictures is too narrow."""
LEAST_GAP = 0.1  # steps of 8 bits, pixels: and of measures that are nearly 0


def none(measure: GapMeasure) -> bool:
    """Whether the gap is zero within its interval, or next to nothing."""
    if measure.gap is UNSET or measure.gap_interval is UNSET or measure.real is UNSET:
        return True
    low, high = measure.gap_interval
    return low <= 0 <= high or abs(measure.gap) <= max(NO_GAP * abs(measure.real), LEAST_GAP)


@dataclass(frozen=True, kw_only=True, eq=False)
class Compared:
    """A comparison, the folder of its report, and our pictures as they were measured after the last fit."""

    report: GapReport
    folder: Path
    measured: list[PictureView]


@pytest.fixture(scope="module")
def lamp(gap, real, small_stage, tmp_path_factory):
    """The fits of light and camera to three pictures in a lamp's light, with a preset."""
    folder, views = tmp_path_factory.mktemp("lamp"), []
    some = linked(folder / "some", real / "lamp", 3)

    def heard(view):
        views.append(view)
        return patch_features(view)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pair_measures, "patch_features", heard)
        report = gap(
            some, small_stage, fit="light,camera", panels=12, write=folder / "bed.usda", out=folder / "report",
            workers=1,
        )  # fmt: skip
    return Compared(report=report, folder=folder, measured=views[-6:][1::2])


def grey_level(linear):
    """The written number, steps of 8 bits, of a linear signal in steps of 8 bits (IEC 61966-2-1)."""
    return 255 * (1.055 * (linear / 255) ** (1 / 2.4) - 0.055)


@pytest.fixture(scope="module")
def alike(gap, real, small_stage, tmp_path_factory):
    """The comparison of two sets that differ in their seed, and its folder."""
    out = tmp_path_factory.mktemp("alike") / "report"
    return gap(real / "nominal", small_stage, out=out), out


@pytest.fixture(scope="module")
def camera(gap, large):
    return gap(large / "dataset" / "image" / "camera", large / "stage" / "dataset.usda", fit="camera")


def test_sets_that_differ_in_their_seed_have_no_gap(alike) -> None:
    report, _ = alike
    assert len(report.pictures) == FRAMES
    assert [name for name, measure in report.summary.items() if not none(measure)] == []
    assert report.summary["correlation"].ours > 0.99
    assert report.summary["wasserstein"].ours < 1
    assert all(part.wasserstein.ours < 2 for part in report.parts.values())
    assert (report.fits, report.left_out, report.notes) == ({}, {}, [])
    assert all(picture.fitted == {} and picture.lights == [] for picture in report.pictures)


def test_a_classifier_cannot_tell_them_apart(alike) -> None:
    report, _ = alike
    low, high = report.summary["classifier_auc"].interval
    assert low - 0.05 <= 0.5 <= high + 0.05
    assert report.summary["classifier_auc"].ours == pytest.approx(0.5, abs=0.15)


def test_silhouettes_are_where_the_labels_are(alike) -> None:
    report, _ = alike
    assert abs(report.summary["silhouette"].real) <= 1
    assert all(abs(each.silhouette["median"]) <= 1 for each in report.pictures)


def test_the_report_is_written_with_a_page_that_needs_no_other_file(alike) -> None:
    report, out = alike
    assert {file.name for file in out.iterdir()} == {"gap.json", "index.html"}
    written = json.loads((out / "gap.json").read_text())
    assert written["schema"] == "gap-report-1"
    assert list(written["summary"]) == list(report.summary)
    page = (out / "index.html").read_text()
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)
    assert all(name in page for name in (*report.summary, *report.parts, *(each.name for each in report.pictures)))


def test_the_planted_camera_is_found(camera) -> None:
    """Level within 2 % and noise within 10 %, of four pictures of 480 x 300; the point spread function within 15 %, as
    an edge's spread is. So small a target has no flat blocks for a photon transfer."""
    fitted = camera.fits["camera"].parameters
    assert fitted["black_level"].value == pytest.approx(LEVEL, rel=0.02)
    assert fitted["noise"].value == pytest.approx(NOISE, rel=0.1)
    assert fitted["psf_sigma"].value == pytest.approx(PSF, rel=0.15)
    for name in ("black_level", "noise", "psf_sigma"):
        low, high = fitted[name].interval
        assert low <= fitted[name].value <= high


def test_the_gap_of_the_camera_is_large_before_and_none_after_the_fit(camera) -> None:
    level, noise = camera.summary["black_level"], camera.summary["noise"]
    assert level.real == pytest.approx(grey_level(LEVEL), abs=0.3)
    assert level.gap < -25
    assert level.fitted_gap == pytest.approx(0, abs=0.3)
    assert noise.gap < -2
    assert noise.fitted_gap == pytest.approx(0, abs=0.1 * noise.real)
    spread = camera.summary["edge_spread"]
    assert abs(spread.fitted_gap) < 0.15 * spread.real < abs(spread.gap)


def test_a_classifier_tells_by_the_camera_and_not_after_the_fit(camera) -> None:
    found = camera.summary["classifier_auc"]
    assert found.ours > 0.9
    assert found.fitted < 0.65
    assert list(found.steps) == ["camera"]


def test_small_targets_keep_their_spread_function(lamp) -> None:
    """Of 240 x 150 pixels: too few clear edges to find one."""
    report = lamp.report
    assert "psf_sigma" not in report.fits["camera"].parameters
    assert all("psf_sigma" not in each.real for each in report.pictures)


def test_the_planted_lamp_is_found(lamp) -> None:
    """A panel where the lamp stands, and hardly anything from elsewhere, brings the pictures back."""
    report = lamp.report
    assert report.summary["correlation"].ours < 0.9
    assert report.summary["correlation"].fitted > 0.95
    assert report.fits["light"].explained > 0.95
    for picture in report.pictures:
        shares = [light.share for light in picture.lights]
        assert 1 <= len(shares) <= 10  # six of them are walls
        assert shares == sorted(shares, reverse=True)
        main = [sum(light.strength * light.direction[axis] for light in picture.lights) for axis in range(3)]
        length = sum(value**2 for value in main) ** 0.5
        expected = lamp_direction()
        assert sum(a * b for a, b in zip(main, expected, strict=True)) / length > 0.8
        for light in picture.lights:
            low, high = light.interval
            assert low <= light.strength * 1.001
            assert light.strength <= high * 1.001


def test_the_fitted_stage_has_no_errors_and_makes_the_pictures_that_gap_measured(lamp, tmp_path) -> None:
    stage = lamp.folder / "report" / "fitted" / "dataset.usda"
    assert Path(lamp.report.fitted_stage) == stage
    assert spin_usd.check(stage).errors == 0
    spin_usd.render(stage, out=tmp_path / "again", renderer="raycast", samples=4, labels="none", frames="0:3", seed=9)
    for measured, picture in zip(lamp.measured, lamp.report.pictures, strict=True):
        again = cv2.imread(str(next((tmp_path / "again" / "image").rglob(f"{picture.name}.*"))), cv2.IMREAD_GRAYSCALE)
        view = PictureView(grey=again.astype(np.float32), parts=measured.parts)
        assert correlation(view.smooth, measured.smooth, measured.target) > 0.99
        assert view.darkness.level == pytest.approx(measured.darkness.level, abs=0.3)


def test_the_preset_and_the_augmentation_draw_pictures_with_the_planted_black_level(lamp, poses, tmp_path) -> None:
    """Light and level of pictures that nothing was fitted to; both files are read by the commands that take them."""
    (tmp_path / "poses.json").write_text(json.dumps(poses[3:5]))
    (tmp_path / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    made = spin_usd.author(
        poses=tmp_path / "poses.json", target="cubesat", camera=tmp_path / "camera.json",
        preset=lamp.folder / "bed.usda", out=tmp_path / "stage",
    )  # fmt: skip
    spin_usd.augment(made.root, spec=lamp.folder / "bed.toml")
    spin_usd.render(made.root, out=tmp_path / "drawn", variants="all", renderer="raycast", samples=4, labels="none")
    files = sorted((tmp_path / "drawn" / "image").rglob("*.png"))
    assert {file.parent.name for file in files} == {"nominal", "bed"}
    assert len(files) == 4
    for file in files:
        grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE).astype(np.float32)
        assert darkness(grey).level == pytest.approx(grey_level(LEVEL), abs=0.5)
        assert np.quantile(grey, 0.99) > 2 * grey_level(LEVEL)  # the target is lit


def lamp_direction():
    """From about the target's place, 1 m before the camera, camera axes (x right, y down, z forward): on the left."""
    away = (-2.2, 0.3, 0.4 - 1.0)
    length = sum(value**2 for value in away) ** 0.5
    return [value / length for value in away]


@pytest.mark.slow
def test_large_pictures_know_the_camera_better(gap, poses, tmp_path) -> None:
    """Three pictures of 960 x 600 by the planted camera. Its flat plates have two or three brightnesses: too few for a
    photon transfer, or just enough."""
    (tmp_path / "poses.json").write_text(json.dumps(poses[:3]))
    (tmp_path / "camera.json").write_text(json.dumps(speedplus_camera(divide=2)))
    made = spin_usd.author(
        poses=tmp_path / "poses.json", target="cubesat", camera=tmp_path / "camera.json", out=tmp_path / "stage"
    )
    planted = plant(Path(made.root), tmp_path / "planted", frames=3)
    spin_usd.render(planted, out=tmp_path / "dataset", variants="camera", renderer="raycast", samples=4, labels="none")
    report = gap(tmp_path / "dataset" / "image" / "camera", made.root, fit="camera", seed=5)
    fitted = report.fits["camera"].parameters
    assert fitted["black_level"].value == pytest.approx(LEVEL, rel=0.01)
    assert fitted["noise"].value == pytest.approx(NOISE, rel=0.03)
    assert fitted["psf_sigma"].value == pytest.approx(PSF, rel=0.1)
    assert "shot_noise" not in fitted or fitted["shot_noise"].value == pytest.approx(SHOT, rel=0.25)
    assert "jpeg_quality" not in fitted  # files without loss

    noisy = f"readNoise = {6 * STEPS * PER_STEP}\n    int spin:sensor:jpegQuality = 75"
    text = planted.read_text().replace(f"readNoise = {NOISE * STEPS * PER_STEP}", noisy)
    planted.write_text(text.replace(f"blackLevel = {LEVEL * STEPS}", f"blackLevel = {30 * STEPS}"))
    spin_usd.render(
        planted, out=tmp_path / "noisy", variants="camera", renderer="raycast", samples=4, labels="none",
        image_format="jpg",
    )  # fmt: skip
    lossy = gap(tmp_path / "noisy" / "image" / "camera", made.root, fit="camera", seed=5).fits["camera"].parameters
    assert lossy["jpeg_quality"].value == 75
    assert lossy["noise"].value == pytest.approx(6, rel=0.05)
    assert lossy["black_level"].value == pytest.approx(30, rel=0.02)


@pytest.mark.slow
def test_the_stages_own_lights_are_fitted_as_factors(gap, real, small_stage) -> None:
    report = gap(real / "nominal", small_stage, fit="light", panels=0)
    for picture in report.pictures:
        (sun,) = picture.lights
        assert sun.name.endswith("/Lights/Sun")
        assert sun.strength == pytest.approx(1, rel=0.02)
        assert sun.distance == 0


@pytest.mark.slow
def test_fits_of_light_and_camera_together_bring_both_back(gap, real, small_stage) -> None:
    report = gap(real / "camera", small_stage, fit="camera,light", panels=24)
    assert list(report.fits) == ["light", "camera"]
    assert report.summary["black_level"].fitted_gap == pytest.approx(0, abs=0.3)
    assert report.summary["correlation"].fitted > 0.95
    assert list(report.summary["correlation"].steps) == ["light", "camera"]


@pytest.mark.slow
def test_fitted_surfaces_stay_within_what_materials_can_be(gap, real, small_stage) -> None:
    """Of pictures of the stage itself: factors near 1, in gap.json with intervals, and the light is fitted again."""
    report = gap(real / "nominal", small_stage, fit="light,surface", panels=0)
    surface = report.fits["surface"].parameters
    assert surface
    assert all(re.fullmatch(r"material\.\w+\.(diffuseColor|roughness|ior)\.factor", name) for name in surface)
    assert all(0.2 <= low <= high <= 5 for low, high in (each.interval for each in surface.values()))
    assert report.summary["correlation"].fitted > 0.99
    assert list(report.summary["correlation"].steps) == ["light", "surface"]
    assert Path(report.fitted_stage).is_file()


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing(gap, real, small_stage) -> None:
    one, three = (gap(real / "camera", small_stage, fit="camera", workers=workers) for workers in (1, 3))
    assert one.summary == three.summary
    assert one.pictures == three.pictures


@pytest.mark.slow
def test_the_stage_stays_as_it_is(gap, real, small_stage, tmp_path) -> None:
    files = sorted(file for file in small_stage.parent.rglob("*") if file.is_file())
    before = [file.read_bytes() for file in files]
    gap(linked(tmp_path / "some", real / "camera", 2), small_stage, fit="light,camera", panels=6)
    assert [file.read_bytes() for file in files] == before


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_real_pictures_of_the_test_bed(shared, gap, tmp_path) -> None:
    """The 25 of SPEED+'s Lightbox: the camera's values are those of ../shared/reference/real.md."""
    bed = shared / "data" / "lightbox"
    if not bed.is_dir():
        pytest.skip("no real pictures of the Lightbox")
    spin_usd.author(
        poses=bed / "lightbox.json", target="tango", camera="speedplus", preset="lightbox", resolution="480x300",
        out=tmp_path / "stage",
    )  # fmt: skip
    report = gap(bed, tmp_path / "stage", fit="light,camera")
    assert len(report.pictures) + len(report.left_out) == 25
    assert len(report.pictures) >= 23
    level = report.summary["black_level"]
    assert level.real == pytest.approx(29.5, abs=2)
    assert level.fitted == pytest.approx(level.real, abs=2)
    assert report.summary["correlation"].steps["light"] > 0.8
    assert report.summary["correlation"].ours < 0.5
    assert any("averaged over 4 x 4 pixels" in note for note in report.notes)


def linked(folder, pictures, count):
    """A folder of the first pictures of another."""
    folder.mkdir(parents=True)
    for file in sorted(pictures.iterdir())[:count]:
        (folder / file.name).symlink_to(file)
    return folder
