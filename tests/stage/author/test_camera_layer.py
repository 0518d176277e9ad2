"""Camera layers: one owner of the lens, everything else derived from it; checked by OpenCV and USD's own frustum."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom

from spin_usd.basics.resources import bundled, bundled_names
from spin_usd.errors import InputError, SpinError
from spin_usd.geometry.camera import Camera
from spin_usd.stage.author.camera_layer import (
    SOLAR_IRRADIANCE,
    WHITE_LEVEL,
    camera_layer_of,
    new_camera_layer,
    open_camera_layer,
    set_resolution,
)
from spin_usd.stage.read.lens import read_lens
from spin_usd.stage.read.sensor import read_sensor

RENDERED = ("cubesat_cdt", "posebowl", "spacesense", "spades", "spark", "spin", "swisscube", "urso")
FLOAT32_PX = 1e-3  # USD keeps focal length and apertures as float32: 6e-8 of 1e4 pixels
FLOAT32 = 1e-6  # relative, the product of five float32 numbers


def prim_of(layer: Sdf.Layer) -> tuple[Usd.Stage, Usd.Prim]:
    stage = Usd.Stage.Open(layer)
    return stage, stage.GetDefaultPrim()


@pytest.mark.parametrize("name", bundled_names("camera"))
def test_every_layer_is_what_follows_from_its_lens(name: str) -> None:
    layer = open_camera_layer(bundled("camera", name))
    stage, prim = prim_of(layer)
    made = new_camera_layer(
        read_lens(prim),
        focal_length=UsdGeom.Camera(prim).GetFocalLengthAttr().Get(),
        documentation=layer.documentation,
        channels=prim.GetAttribute("spin:sensor:channels").Get(),
        ideal=not prim.HasAPI("SpinOpticsAPI"),
    )
    assert made.ExportToString() == layer.ExportToString()
    assert bundled("camera", name).read_text() == layer.ExportToString()  # as USD itself would write it
    assert stage.GetDefaultPrim().GetName() == "Camera"


def test_only_cameras_of_rendered_sets_are_ideal() -> None:
    for name in bundled_names("camera"):
        stage, prim = prim_of(open_camera_layer(bundled("camera", name)))
        assert stage
        noisy = read_sensor(prim, Usd.TimeCode.Default()).gain > 0
        assert noisy == prim.HasAPI("SpinOpticsAPI") == (name not in RENDERED), name


def test_white_fills_the_wells_of_a_camera_that_says_nothing_of_its_noise() -> None:
    """Published: a maximum signal to noise of 45.1 dB, which is that of photons, and 73 dB from there to the dark."""
    camera = Camera(width=64, height=48, fx=50.0, fy=50.0, cx=32.0, cy=24.0)
    stage, prim = prim_of(camera_layer_of(camera, pixel_pitch=1e-5, documentation=""))
    assert stage
    sensor = read_sensor(prim, Usd.TimeCode.Default())
    assert 20 * math.log10(math.sqrt(sensor.full_well)) == pytest.approx(45.1, abs=0.05)
    assert 20 * math.log10(sensor.full_well / sensor.read_noise) == pytest.approx(73, abs=0.5)
    assert sensor.gain * (2**sensor.adc_bits - 1) == pytest.approx(sensor.full_well, rel=0.01)


@pytest.mark.parametrize("name", bundled_names("camera"))
def test_usds_frustum_projects_as_opencv_without_distortion(name: str) -> None:
    stage, prim = prim_of(open_camera_layer(bundled("camera", name)))
    camera = read_lens(prim)
    view = UsdGeom.Camera(prim).GetCamera(Usd.TimeCode.Default())
    points = np.random.default_rng(1).uniform([-1, -1, 3], [1, 1, 9], (50, 3))
    matrix = np.array(view.frustum.ComputeProjectionMatrix())
    clip = np.c_[points * (1, -1, -1), np.ones(50)] @ matrix  # USD looks along -z with y up
    ndc = clip[:, :2] / clip[:, 3:]
    uv = (ndc * (1, -1) + 1) / 2 * (camera.width, camera.height)
    want, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, np.zeros(5))
    assert np.abs(uv - want[:, 0]).max() < FLOAT32_PX
    assert stage.GetMetadata("metersPerUnit") == 1


def test_a_white_surface_in_the_sun_comes_out_at_the_white_level() -> None:
    _stage, prim = prim_of(open_camera_layer(bundled("camera", "speedplus")))
    scale = UsdGeom.Camera(prim).ComputeLinearExposureScale()
    assert scale * SOLAR_IRRADIANCE / math.pi == pytest.approx(WHITE_LEVEL, rel=FLOAT32)


def test_the_interchange_names_hold_the_lens() -> None:
    """The names that NVIDIA's renderers read (ovrtx documentation, "Lens Calibration")."""
    lens = (0.1, 0.2, 0.3, 0.4, 0.5)
    camera = Camera(width=64, height=48, fx=50.0, fy=51.0, cx=30.0, cy=20.0, distortion=lens)
    stage, prim = prim_of(camera_layer_of(camera, pixel_pitch=1e-5, documentation=""))
    assert stage
    assert "OmniLensDistortionOpenCvPinholeAPI" in prim.GetPrimTypeInfo().GetAppliedAPISchemas()
    assert prim.GetAttribute("omni:lensdistortion:model").Get() == "opencvPinhole"
    head = "omni:lensdistortion:opencvPinhole:"
    assert prim.GetAttribute(head + "imageSize").Get() == Gf.Vec2i(64, 48)
    names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
    values = [prim.GetAttribute(head + name).Get() for name in names]
    assert values == pytest.approx([50, 51, 30, 20, *lens, *[0] * 7], rel=FLOAT32)
    assert read_lens(prim) == camera


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(InputError, match="speedplus"):
        bundled("camera", "hubble")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('#usda 1.0\n(\n defaultPrim = "Camera"\n metersPerUnit = 1\n)\ndef Camera "Camera" {\n}\n', "SpinLensAPI"),
        ('#usda 1.0\n(\n defaultPrim = "Camera"\n)\ndef Camera "Camera" {\n}\n', "metersPerUnit"),
        ('#usda 1.0\n(\n defaultPrim = "A"\n)\ndef Xform "A" {\n}\n', "Camera"),
        ("not usd", "USD layer"),
    ],
)
def test_other_layers_are_refused_by_name(tmp_path: Path, text: str, found: str) -> None:
    path = tmp_path / "camera.usda"
    path.write_text(text)
    with pytest.raises(SpinError, match=found) as caught:
        open_camera_layer(path)
    assert "camera.usda" in str(caught.value)


@pytest.mark.parametrize(("resolution", "size"), [("256", (256, 160)), ("480x300", (480, 300)), ("3840", (3840, 2400))])
def test_another_resolution_sees_the_same(resolution: str, size: tuple[int, int]) -> None:
    """OpenCV projects points to the same places of the frame, and USD's own frustum is the same."""
    before, after = (open_camera_layer(bundled("camera", "speedplus")) for _ in range(2))
    assert set_resolution(after, resolution) == ()
    (_, old), (stage, new) = prim_of(before), prim_of(after)
    lens, scaled = read_lens(old), read_lens(new)
    assert (scaled.width, scaled.height) == size
    points = np.random.default_rng(0).uniform((-1, -0.6, 5), (1, 0.6, 9), (50, 3))
    there, here = (
        cv2.projectPoints(points, np.zeros(3), np.zeros(3), each.matrix, np.array(each.distortion))[0][:, 0]
        / (each.width, each.height)
        for each in (lens, scaled)
    )
    assert np.abs(there - here).max() < 1e-12
    frusta = [UsdGeom.Camera(prim).GetCamera().frustum for prim in (old, new)]
    assert np.abs(np.array(frusta[0].window.min) - np.array(frusta[1].window.min)).max() < FLOAT32
    assert stage


@pytest.mark.parametrize("resolution", ["0", "256x", "axb", "-4", "1e3", "", "123456"])
def test_no_resolution_is_refused(resolution: str) -> None:
    with pytest.raises(InputError, match="is not a number of pixels; write for example 256"):
        set_resolution(open_camera_layer(bundled("camera", "speedplus")), resolution)


def test_what_optics_have_in_pixels_is_scaled_and_another_form_is_said() -> None:
    layer = open_camera_layer(bundled("camera", "speedplus"))
    _stage, prim = prim_of(layer)
    prim.ApplyAPI("SpinOpticsAPI")
    prim.GetAttribute("spin:optics:psfSigma").Set(1.5)
    (note,) = set_resolution(layer, "480x480")
    assert "of another form than the camera's 1920 x 1200" in note
    assert prim.GetAttribute("spin:optics:psfSigma").Get() == pytest.approx(1.5 * math.sqrt(0.25 * 0.4))
