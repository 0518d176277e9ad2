"""Calibrations of others: read with their own pixels, and projected as OpenCV projects with them."""

import json
import re

import cv2
import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.exchange.read_camera import read_camera
from spin_usd.exchange.read_pose_list import read_pose_list

EXACT_PX = 1e-9
PINHOLE = [-0.21, 0.07, 1e-3, -2e-3, 0.01]
FISHEYE = [0.012, -0.012, 0.02, -0.004]
K = np.array([[501.5, 0, 318.25], [0, 502.5, 241.75], [0, 0, 1.0]])
POINTS = np.random.default_rng(1).uniform((-0.5, -0.4, 1), (0.5, 0.4, 2), (50, 3))


def opencv(distortion, fisheye):
    """Where OpenCV sees the points, in its own pixels."""
    project = cv2.fisheye.projectPoints if fisheye else cv2.projectPoints
    return project(POINTS[:, None], np.zeros(3), np.zeros(3), K, np.array(distortion))[0][:, 0]


def storage(path, **values):
    """Write the values with cv2.FileStorage."""
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        file.write(name, value)
    file.release()
    return path


def stored(suffix, model, distortion):
    return lambda folder: storage(
        folder / f"cv.{suffix}", image_width=640, image_height=480, camera_matrix=K,
        distortion_coefficients=np.array(distortion)[None], **({"distortion_model": model} if model else {}),
    )  # fmt: skip


def text(name, content):
    def write(folder):
        (folder / name).write_text(content)
        return folder / name

    return write


ROS = f"""image_width: 640
image_height: 480
camera_name: left
camera_matrix:
  rows: 3
  cols: 3
  data: {K.ravel().tolist()}
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: {PINHOLE}
"""
CAMERA_INFO = f"""height: 480
width: 640
distortion_model: "equidistant"
D: {FISHEYE}
K: {K.ravel().tolist()}
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
"""
KALIBR = f"""cam0:
  camera_model: pinhole
  distortion_coeffs: {FISHEYE}
  distortion_model: equidistant
  intrinsics: [{K[0, 0]}, {K[1, 1]}, {K[0, 2]}, {K[1, 2]}]
  resolution: [640, 480]
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, 0.1]
  - [0.0, 1.0, 0.0, 0.0]
  camera_model: pinhole
  distortion_coeffs: [0.1, 0.0, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [400.0, 400.0, 320.0, 240.0]
  resolution: [640, 480]
"""
EUROC = f"""# General sensor definitions.
sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, 0.0,
         0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
resolution: [640, 480]
camera_model: pinhole
intrinsics: [{K[0, 0]}, {K[1, 1]}, {K[0, 2]}, {K[1, 2]}] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: {PINHOLE[:4]}
"""
BOP = json.dumps({"width": 640, "height": 480, "fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2],
                  "depth_scale": 0.1})  # fmt: skip
NERFSTUDIO = json.dumps({"camera_model": "OPENCV_FISHEYE", "w": 640, "h": 480, "fl_x": K[0, 0], "fl_y": K[1, 1],
                         "cx": K[0, 2], "cy": K[1, 2], **dict(zip(["k1", "k2", "k3", "k4"], FISHEYE, strict=True)),
                         "frames": []})  # fmt: skip
BENCH = {"Nu": 640, "Nv": 480, "cameraMatrix": K.tolist(), "distortion_model": "equidistant", "distCoeffs": FISHEYE}
COLMAP = f"1 OPENCV_FISHEYE 640 480 {K[0, 0]} {K[1, 1]} {K[0, 2]} {K[1, 2]} {' '.join(map(str, FISHEYE))}\n"
FULL = f"# a\n1 FULL_OPENCV 640 480 {K[0, 0]} {K[1, 1]} {K[0, 2]} {K[1, 2]} {' '.join(map(str, PINHOLE))} 0 0 0\n"
OST = f"""# oST version 5.0 parameters

[image]

width
640

height
480

[left]

camera matrix
{chr(10).join(" ".join(map(str, row)) for row in K.tolist())}

distortion
{" ".join(map(str, PINHOLE))}

rectification
1 0 0
0 1 0
0 0 1
"""
F = dict(zip(("fx", "fy", "cx", "cy"), K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(), strict=True))
OF_PINHOLE = F | dict(zip(("k1", "k2", "p1", "p2", "k3"), PINHOLE, strict=True))
OF_FISHEYE = F | dict(zip(("k1", "k2", "k3", "k4"), FISHEYE, strict=True))


def indented(values, begin):
    return "".join(f"{begin}{name}: {value}\n" for name, value in values.items())


ORB_SIZE = "Camera.width: 640\nCamera.height: 480\n"
ORB = f"%YAML:1.0\n{indented(OF_PINHOLE, 'Camera.')}{ORB_SIZE}Camera.bf: 47.9\n"
ORB3 = (
    f'%YAML:1.0\nCamera.type: "KannalaBrandt8"\n{indented(OF_FISHEYE, "Camera1.")}{ORB_SIZE}'
    f"{indented(OF_PINHOLE, 'Camera2.')}"
)
VINS_SIZE = "camera_name: camera\nimage_width: 640\nimage_height: 480\n"
VINS_K = indented(dict(list(OF_PINHOLE.items())[4:]), "   ")
VINS = (
    f"%YAML:1.0\n---\nmodel_type: PINHOLE\n{VINS_SIZE}distortion_parameters:\n{VINS_K}"
    f"projection_parameters:\n{indented(F, '   ')}"
)
KANNALA = dict(zip(("k2", "k3", "k4", "k5", "mu", "mv", "u0", "v0"), [*FISHEYE, *F.values()], strict=True))
VINS_FISHEYE = (
    f"%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\n{VINS_SIZE}projection_parameters:\n{indented(KANNALA, '   ')}"
)
SVO = f"""label: rig
cameras:
- camera:
    distortion:
      parameters:
        cols: 1
        rows: 4
        data: {FISHEYE}
      type: equidistant
    image_height: 480
    image_width: 640
    intrinsics:
      cols: 1
      rows: 4
      data: {list(F.values())}
    label: cam
    type: pinhole
"""
VIKIT = (
    f"cam_model: Pinhole\ncam_width: 640\ncam_height: 480\n{indented(F, 'cam_')}"
    f"{indented(dict(zip(('d0', 'd1', 'd2', 'd3'), PINHOLE, strict=False)), 'cam_')}"
)
BASALT = {
    "value0": {
        "T_imu_cam": [{"px": 0}, {"px": 0}],
        "intrinsics": [{"camera_type": "kb4", "intrinsics": OF_FISHEYE}, {"camera_type": "ds", "intrinsics": F}],
        "resolution": [[640, 480], [752, 480]],
    }
}
REALSENSE = json.dumps(
    {"width": 640, "height": 480, "fx": K[0, 0], "fy": K[1, 1], "ppx": K[0, 2], "ppy": K[1, 2],
     "model": "distortion.brown_conrady", "coeffs": PINHOLE}
)  # fmt: skip


@pytest.mark.parametrize(
    ("write", "kind", "distortion", "shift"),
    [
        (stored("yaml", "", PINHOLE), "OpenCV", PINHOLE, 0.5),
        (stored("xml", "", PINHOLE), "OpenCV", PINHOLE, 0.5),
        (text("ost.txt", OST), "ROS ost.txt", PINHOLE, 0.5),
        (text("orb.yaml", ORB), "ORB-SLAM", PINHOLE, 0.5),
        (text("orb3.yaml", ORB3), "ORB-SLAM", FISHEYE, 0.5),
        (text("vins.yaml", VINS), "VINS", PINHOLE, 0.5),
        (text("vins.yaml", VINS_FISHEYE), "VINS", FISHEYE, 0.5),
        (text("svo.yaml", SVO), "SVO", FISHEYE, 0.5),
        (text("vikit.yaml", VIKIT), "SVO", PINHOLE[:4], 0.5),
        (text("basalt.json", json.dumps(BASALT)), "basalt", FISHEYE, 0.5),
        (text("realsense.json", REALSENSE), "RealSense", PINHOLE, 0.5),
        (text("t265.yaml", ROS.replace("plumb_bob", "equidistant").replace(str(PINHOLE), str([*FISHEYE, 0.0]))),
         "ROS", FISHEYE, 0.5),
        (stored("json", "", PINHOLE), "OpenCV", PINHOLE, 0.5),
        (stored("yaml", "", [*PINHOLE, 0.0, 0.0, 0.0]), "OpenCV", PINHOLE, 0.5),
        (stored("yml", "equidistant", FISHEYE), "ROS", FISHEYE, 0.5),
        (text("ost.yaml", ROS), "ROS", PINHOLE, 0.5),
        (text("info.yaml", CAMERA_INFO), "ROS", FISHEYE, 0.5),
        (text("camchain.yaml", KALIBR), "Kalibr", FISHEYE, 0.5),
        (text("sensor.yaml", EUROC), "Kalibr", PINHOLE[:4], 0.5),
        (text("camera.json", BOP), "BOP", [0.0] * 5, 0.5),
        (text("transforms.json", NERFSTUDIO), "nerfstudio", FISHEYE, 0.0),
        (text("bench.json", json.dumps(BENCH)), "SPEED+", FISHEYE, 0.0),
        (text("cameras.txt", COLMAP), "COLMAP", FISHEYE, 0.0),
        (text("cameras.txt", FULL), "COLMAP", PINHOLE, 0.0),
    ],
)  # fmt: skip
def test_it_projects_as_opencv_does_with_the_files_own_pixels(tmp_path, write, kind, distortion, shift) -> None:
    """Where the first pixel's centre is (0, 0), ours are half a pixel more than those of the file."""
    found = read_camera(write(tmp_path))
    assert (found.camera.width, found.camera.height) == (640, 480)
    seen = opencv(distortion, distortion == FISHEYE)
    np.testing.assert_allclose(found.camera.project(POINTS), seen + shift, rtol=0, atol=EXACT_PX)
    assert f"is read as {kind}" in found.notes[0]
    assert ("half a pixel is added" if shift else "as here") in found.notes[0]


@pytest.mark.parametrize(
    ("content", "note"),
    [
        (json.dumps(BASALT), "holds 2 cameras, of which the first is used"),
        (ORB3, "holds 2 cameras, of which the first is used"),
        (ROS.replace(str(PINHOLE), "[1200, -350, 0.001, 0.001, 90]"), "scales its corners by 9.51: check its coeff"),
        (
            ROS.replace("501.5", "250").replace("502.5", "250").replace(str(PINHOLE), "[]"),
            "sees 116 degrees from corner",
        ),
    ],
)
def test_what_is_odd_of_a_camera_is_told(tmp_path, content, note) -> None:
    notes = read_camera(text("camera.yaml", content)(tmp_path)).notes
    assert any(note in each for each in notes), notes


def test_numbers_with_names_may_stand_beside_lists(tmp_path) -> None:
    size, matrix = "width: 640\nheight: 480\n", "T: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
    words = f"{size}{indented(F, '')}{matrix}distortion_model: equidistant\ndistortion: {FISHEYE}\n"
    found = read_camera(text("own.yaml", words)(tmp_path))
    assert (tuple(found.camera.distortion), len(found.notes)) == (tuple(FISHEYE), 1)
    without = read_camera(text("own.yaml", f"{size}{indented(F, '')}")(tmp_path))
    assert "taken for one without distortion" in without.notes[1]
    with pytest.raises(InputError, match=r"has '.*' and '.*', which differ"):
        read_camera(text("own.yaml", f"{ORB}distortion_coefficients: {FISHEYE}\n")(tmp_path))


def test_our_own_colmap_camera_is_read_back(tmp_path) -> None:
    pycolmap_line = "2 SIMPLE_RADIAL_FISHEYE 640 480 501.5 318.25 241.75 0.012\n"
    camera = read_camera(text("cameras.txt", pycolmap_line)(tmp_path)).camera
    assert camera.fisheye
    assert (camera.fx, camera.fy, camera.cx, camera.distortion) == (501.5, 501.5, 318.25, (0.012, 0, 0, 0))


@pytest.mark.parametrize(
    ("name", "content", "found"),
    [
        ("cv.yaml", ROS.replace("image_width: 640\nimage_height: 480\n", ""), "has no image size"),
        ("cv.yaml", "image_width: 640\nimage_height: 480\n", "has no camera matrix"),
        ("cv.json", json.dumps({"w": 640, "h": 480, "K": K.tolist(), "D": FISHEYE}), "has four coefficients"),
        ("ros.yaml", ROS.replace("plumb_bob", "rational_polynomial").replace("cols: 5", "cols: 8")
         .replace("0.01]", "0.01, 0.1, 0.0, 0.0]"), "more than k1, k2, p1, p2, k3"),
        ("kalibr.yaml", KALIBR.replace("camera_model: pinhole", "camera_model: omni", 1), "camera model 'omni'"),
        ("kalibr.yaml", KALIBR.replace("equidistant", "fov"), "model 'fov'"),
        ("orb.yaml", ORB.replace(ORB_SIZE, ""), "has no image size"),
        ("vins.yaml", VINS.replace("PINHOLE", "MEI"), "camera model 'MEI'"),
        ("vikit.yaml", VIKIT.replace("Pinhole", "ATAN"), "camera model 'ATAN'"),
        ("basalt.json", json.dumps(BASALT).replace("kb4", "ds"), "camera model 'ds'"),
        ("realsense.json", REALSENSE.replace("brown", "inverse_brown"), "camera model 'inverse_brown_conrady'"),
        ("ost.txt", OST.replace("0.01\n", "0.01 0.1 0 0\n"), "more than k1, k2, p1, p2, k3"),
        ("orb.yaml", ORB.replace("width: 640", "width: nan"), "has a size of nan x 480"),
        ("cv.xml", "<opencv_storage><camera_matrix>", "is damaged"),
        ("cv.xml", "<!DOCTYPE a><opencv_storage/>", "defines entities"),
        ("cv.xml", "<calibration><width>640</width></calibration>", "is XML of <calibration>"),
        ("cameras.txt", "1 FOV 640 480 500 500 320 240 0.1\n", "but FOV"),
        ("cameras.txt", "1 PINHOLE 640 480 500 500\n", "no whole camera"),
        ("calib.txt", "hello\n", "no names with values|no YAML"),
        ("a.yaml", "a:\n  - [1, 2\n  b", "subset of YAML"),
        ("a.yaml", "[" * 10000, "not JSON|nested"),
        ("transforms.json", NERFSTUDIO.replace("OPENCV_FISHEYE", "EQUIRECTANGULAR"), "model 'EQUIRECTANGULAR'"),
        ("transforms.json", NERFSTUDIO.replace("[]", '[{"fl_x": 3}]'), "cameras of its own"),
        ("a.json", "[1]", "no names with values"),
        ("a.yaml", ROS.replace("501.5", "nan"), "nine numbers|NaN|camera matrix"),
    ],
)  # fmt: skip
def test_what_is_lacking_is_said_of_the_file(tmp_path, name, content, found) -> None:
    path = text(name, content)(tmp_path)
    with pytest.raises(InputError, match=re.compile(found)) as caught:
        read_camera(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_without_coefficients_says_so(tmp_path) -> None:
    plain = ROS.partition("distortion_coefficients")[0]
    found = read_camera(text("ost.yaml", plain)(tmp_path))
    assert not found.camera.distorted
    assert "taken for one without distortion" in found.notes[1]


@pytest.mark.parametrize(
    "content",
    [
        "a" + " " * 3_000_000 + "b",
        "K:\n  - " + "- " * 500_000,
        "data: [" + "1,\n" * 500_000,
        "x: " + "[" * 50 + "1 " * 500_000,
        "a: b\n" * 300_000,
        " " * 1_000_000 + ":x",
    ],
)
@pytest.mark.timeout(20)
def test_a_hostile_file_takes_no_time(tmp_path, content) -> None:
    with pytest.raises(InputError):
        read_camera(text("a.yaml", content)(tmp_path))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("cameras.txt", "1 SIMPLE_PINHOLE 640 480 500 500 320 240\n"),
        ("cameras.txt", "1 OPENCV 640 480 500 500 320 240 0.1\n"),
        ("transforms.json", '{"fl_x": 1, "frames": null}'),
        ("transforms.json", '{"fl_x": 1, "distortion_params": [0.1], "frames": []}'),
        ("list.json", '[{"fl_x": 1}]'),
        ("names.json", '["fx", "fy", "cx", "cy", "depth_scale"]'),
    ],
)
def test_numbers_too_many_or_in_another_form_are_refused(tmp_path, name, content) -> None:
    with pytest.raises(InputError, match=r"no whole camera|no camera"):
        read_camera(text(name, content)(tmp_path))


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("camera_model: pinhole", "has four coefficients without a model"),
        ("fisheye_model: 1\ndistortion_model: plumb_bob", "lens: fisheye_model: 1.* and .*plumb_bob"),
        (
            "fisheye_model: 0\ndistortion_model: equidistant",
            "lens: fisheye_model: 0.* and .*equidistant",
        ),
        (
            "camera_model: fisheye\ndistortion_model: plumb_bob",
            "about its lens: .*plumb_bob and .*fisheye",
        ),
        ("distortion_model: plumb_bob\ncamera_model: omni", "the model 'omni'"),
        ("fisheye: False\ndistortion_model: equidistant", "contradicts itself about its lens"),
        ("fisheye: perhaps", "has fisheye: perhaps"),
        ("K: [600, 0, 319, 0, 600, 240, 0, 0, 1]", "has 'camera_matrix' and 'K', which differ"),
        ("D: [0.1, 0, 0, 1]", "has 'distortion_coefficients' and 'D', which differ"),
        ("size: [9, 6]", "has 'image_size' and 'size', which differ"),
        ("image_width: 641", "has the key 'image_width' twice"),
        ("roi: {x_offset: 0, x_offset: 8}", "has the key 'x_offset' twice"),
        (
            "distortion_model: plumb_bob\nbinning_x: 2",
            "has binning_x: its pictures and its camera matrix",
        ),
        ("distortion_model: plumb_bob\nroi:\n  x_offset: 8\n  y_offset: 0\n  height: 48\n  width: 64", "has a roi"),
        ("distortion_model: plumb_bob\nroi:\n  height: 240\n  width: 640", "has a roi"),
    ],
)
def test_what_says_nothing_of_a_lens_or_two_things_is_refused(tmp_path, words, found) -> None:
    content = f"image_width: 640\nimage_height: 480\n{words}\n"
    content += "camera_matrix: [600, 0, 320, 0, 600, 240, 0, 0, 1]\ndistortion_coefficients: [0.1, 0, 0, 0]\n"
    with pytest.raises(InputError, match=found):
        read_camera(text("a.yaml", content)(tmp_path))


WHOLE = [
    "binning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: False",
    "binning_x: 1\nbinning_y: 1\nroi: {x_offset: 0, y_offset: 0, height: 480, width: 640, do_rectify: true}",
    f"camera_matrix: {K.tolist()}\nnew_camera_matrix: [1, 0, 2, 0, 1, 2, 0, 0, 1]\nfisheye_model: 1",
]


@pytest.mark.parametrize("words", WHOLE)
def test_all_pixels_and_one_thing_said_twice_are_read(tmp_path, words) -> None:
    """ROS: an all-zero roi is the full resolution, and a binning of 0 is that of 1."""
    camera = read_camera(text("info.yaml", f"{CAMERA_INFO}{words}\n")(tmp_path)).camera
    assert (camera.width, camera.cx, camera.fisheye) == (640, K[0, 2] + 0.5, True)


def test_a_fisheye_of_nerfstudio_says_so_once(tmp_path) -> None:
    content = NERFSTUDIO.replace('"frames"', '"is_fisheye": false, "frames"')
    with pytest.raises(InputError, match="camera_model 'OPENCV_FISHEYE', and is_fisheye False"):
        read_camera(text("transforms.json", content)(tmp_path))


@pytest.mark.parametrize("suffix", ["yaml", "json", "xml"])
def test_a_matrix_of_other_sides_than_its_numbers_is_refused(tmp_path, suffix) -> None:
    path = stored(suffix, "", PINHOLE)(tmp_path)
    path.write_text(re.sub(r"(cols\W+)5", r"\g<1>4", path.read_text()))
    with pytest.raises(InputError, match=r"5 numbers as a matrix of 1 x 4, the distortion .*; correct its rows"):
        read_camera(path)


def test_a_file_of_the_other_option_is_named(tmp_path) -> None:
    camera, poses = stored("yaml", "", PINHOLE)(tmp_path), tmp_path / "poses.csv"
    poses.write_text("name,qw,qx,qy,qz,x,y,z\na,1,0,0,0,0,0,5\n")
    with pytest.raises(InputError, match=r"is a calibration \(OpenCV\); give it as --camera"):
        read_pose_list(camera)
    with pytest.raises(InputError, match=r"is a pose list \(CSV\); give it as --poses"):
        read_camera(poses)
