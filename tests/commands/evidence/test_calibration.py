"""Test charts bring back what was planted in camera, optics and detector, within 2 %."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from msgspec import UNSET

import spin_usd
from spin_usd.basics.resources import stages
from spin_usd.commands.evidence.calibration import Chart, calibrated
from spin_usd.commands.evidence.calls import Calibrate
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import CPU, QUALITIES
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.picture_request import PictureRequest
from spin_usd.studio.studio import Studio
from tests.cases.root_layers import over_stage

WITHIN = 0.02
LINEAR = 1e-3  # of the signal: a detector of 12 bits rounds to a quarter of this
SETTINGS = RenderSettings(renderer="raycast", effort=QUALITIES["draft"], seed=0, device=CPU)
PLANTED = {"blackLevel": 20.0, "gain": 5.0, "readNoise": 15.0, "darkCurrent": 4000.0, "prnu": 0.01}


def planted(stage, folder, *, psf, settings):
    """A copy of a stage whose camera has these settings: its root layer."""
    shutil.copytree(stage.parent, folder)
    lines = [f"double spin:sensor:{name} = {value}" for name, value in settings.items()]
    body = "\n".join(['over "Camera"', "{", *lines, f"double spin:optics:psfSigma = {psf}", "}"])
    (folder / "planted.usda").write_text(over_stage(frames=8, body=body))
    return folder / "planted.usda"


def charts(stage):
    return calibrated(Calibrate(stage=str(stage), variant="nominal", settings=SETTINGS))


@pytest.mark.parametrize("psf", [0.5, 0.9, 2.0])
def test_planted_settings_come_back(small_stage, tmp_path, psf) -> None:
    found = charts(planted(small_stage, tmp_path / "stage", psf=psf, settings=PLANTED))
    assert found["psf_sigma"].claimed == psf
    assert found["gain"].claimed == PLANTED["gain"]
    assert found["dark_noise"].claimed == pytest.approx(np.hypot(15.0, np.sqrt(4000.0 * 0.01 / 2)), rel=1e-6)
    for name in ("radiance", "psf_sigma", "gain", "dark_noise"):
        assert found[name].measured == pytest.approx(found[name].claimed, rel=WITHIN), name
    assert found["nonlinearity"].measured < LINEAR


def test_a_detector_that_is_not_what_its_settings_claim_is_seen(small_stage, tmp_path, monkeypatch) -> None:
    """The pictures of one detector beside the claims of another."""
    stage = planted(small_stage, tmp_path / "stage", psf=1.0, settings=PLANTED)
    taken = Chart.pictures

    def other(self, radiance, seeds, exposure=1.0):
        plate = replace(self.plate, optics=replace(self.plate.optics, psf_sigma=1.5))
        changed = replace(self, plate=plate, sensor=replace(self.sensor, gain=8.0, read_noise=40.0))
        return taken(changed, radiance, seeds, exposure)

    monkeypatch.setattr(Chart, "pictures", other)
    found = charts(stage)
    assert found["psf_sigma"].measured == pytest.approx(1.5, rel=WITHIN)
    assert found["gain"].measured == pytest.approx(8.0, rel=WITHIN)
    assert found["dark_noise"].measured == pytest.approx(np.hypot(40.0, np.sqrt(20.0)), rel=WITHIN)
    assert (found["psf_sigma"].claimed, found["gain"].claimed) == (1.0, 5.0)


def test_a_detector_without_noise_has_no_gain_and_no_noise(small_stage, tmp_path) -> None:
    found = charts(
        planted(small_stage, tmp_path / "stage", psf=0.0, settings={"gain": 0.0, "fullWell": 0.0, "readNoise": 0.0})
    )
    assert set(found) == {"radiance", "nonlinearity", "psf_sigma"}
    assert found["radiance"].measured == pytest.approx(found["radiance"].claimed, rel=WITHIN)
    assert found["psf_sigma"].measured < 0.1


def test_noise_that_the_rounding_hides_is_not_claimed_to_be_measured(small_stage, tmp_path) -> None:
    found = charts(planted(small_stage, tmp_path / "stage", psf=1.0, settings={"gain": 20.0, "readNoise": 2.0}))
    assert found["dark_noise"].measured is UNSET
    assert found["gain"].measured == pytest.approx(20.0, rel=WITHIN)


def test_the_charts_are_a_stage_without_errors() -> None:
    report = spin_usd.check(stages() / "charts" / "plate.usda")
    assert [finding.code for finding in report.findings] == ["target-cut-off"]  # it fills the view


@pytest.mark.parametrize("lens", ["fisheye", "colour"])
def test_other_cameras(small_stage, lens) -> None:
    """A fisheye, and a detector in colour with filters of its own."""
    scene = OpenStage(small_stage).scene(PictureRequest())
    studio = Studio(SETTINGS)
    studio.open_renderer()
    if lens == "fisheye":
        scene = replace(scene, camera=replace(scene.camera, distortion=Fisheye(-0.05, 0.001, 0, 0), fx=120, fy=120))
    else:
        scene = replace(scene, sensor=replace(scene.sensor, channels="rgb", quantum_efficiency=(0.3, 0.5, 0.4)))
    found = Chart.of(scene, studio).measured()
    for name in ("radiance", "psf_sigma", "gain", "dark_noise"):
        assert found[name].measured == pytest.approx(found[name].claimed, rel=WITHIN), name


def test_a_camera_beside_its_principal_point_is_not_measured(small_stage, tmp_path) -> None:
    stage = planted(small_stage, tmp_path / "stage", psf=1.0, settings=PLANTED)
    beside = "double spin:lens:cx = 700\ndouble spin:optics"
    stage.write_text(stage.read_text().replace("double spin:optics", beside))
    assert charts(stage) == {}
