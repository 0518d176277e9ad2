"""Several cameras on one body, from author to what the dataset says: a rectified pair, and a third that looks aside."""

import json
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from spin_usd import Dataset, author
from spin_usd.errors import InputError
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.geometry.transform import Transform
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

PAIR = {"Nu": 96, "Nv": 72, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[130, 0, 48], [0, 130, 36], [0, 0, 1]]}
WIDE = {**PAIR, "Nu": 64, "Nv": 64, "cameraMatrix": [[40, 0, 31], [0, 42, 33], [0, 0, 1]]}
BASELINE = 0.5  # metres
ASIDE = [0.8, 0, 0.6, 0]  # the wide camera's quaternion in the first one's axes ...
PLACE = [-4.0, 0.1, 2.0]  # ... and its place
FLOAT32 = 1e-6  # of disparity and depth, relative
EXACT = 1e-9  # of poses, metres
BRIGHT = """
schema = "augment-1"
seed = 0
[[augmentation]]
name = "bright"
[augmentation.sample]
"exposure.iso" = { distribution = "uniform", low = 700, high = 700, per = "augmentation" }
"""
POSES = [([0.8, 0.36, 0.48, 0], (0.1, 0.1, 4)), ([0.36, 0.48, 0.8, 0], (-0.1, 0, 5))]


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cameras")
    trimesh.creation.box((1, 0.8, 0.6)).export(folder / "craft.stl")
    for name, camera in (("left", PAIR), ("wide", WIDE)):
        (folder / f"{name}.json").write_text(json.dumps(camera))
    (folder / "poses.json").write_text(entries(*POSES))
    (folder / "mounting.json").write_text(entries((ASIDE, PLACE)))
    cameras = (
        f"left={folder / 'left.json'}",
        f"right={folder / 'left.json'}:{BASELINE},0,0",
        f"{folder / 'wide.json'}:{folder / 'mounting.json'}",
    )
    options = {"poses": folder / "poses.json", "target": folder / "craft.stl", "units_per_metre": 1}
    options["range_finder"] = "0.5:0,0,-0.25"
    author(out=folder / "stage", camera=cameras, channels="rgb", **options)
    return folder / "stage"


def entries(*poses):
    return json.dumps(
        [
            {"filename": f"p{i}.png", "q_vbs2tango_true": q, "r_Vo2To_vbs_true": list(t)}
            for i, (q, t) in enumerate(poses)
        ]
    )


@pytest.fixture(scope="module")
def rendered(stage, tmp_path_factory, spin_usd):
    out = tmp_path_factory.mktemp("rendered") / "dataset"
    spin_usd("render", stage, "--out", out, "--renderer", "raycast", "--samples", "1", "--labels", "all")
    return out


@pytest.fixture(scope="module")
def dataset(rendered):
    return Dataset(rendered)


def test_each_camera_takes_a_picture_of_each_frame(dataset) -> None:
    assert dataset.variants == ("nominal", "nominal-right", "nominal-wide")
    named = {picture.variant: picture.record["rig"]["camera"] for picture in dataset}
    assert named == {"nominal": "left", "nominal-right": "right", "nominal-wide": "wide"}
    assert {(picture.variant, *picture.image.shape) for picture in dataset} == {
        ("nominal", 72, 96, 3),
        ("nominal-right", 72, 96, 3),
        ("nominal-wide", 64, 64, 3),
    }


def test_poses_are_those_of_a_body_that_all_of_them_see(dataset) -> None:
    T_left_wide = Transform.from_quaternion(to="left", of="wide", q=ASIDE, t=PLACE).matrix
    for frame, (q, t) in zip(("p0", "p1"), POSES, strict=True):
        left, right, wide = (dataset.picture(frame, variant) for variant in dataset.variants)
        np.testing.assert_allclose(left.T_cam_body[:3, :3], matrix_from_quaternion(q), atol=EXACT)
        np.testing.assert_allclose(left.t_cam_body, t, atol=EXACT)
        np.testing.assert_allclose(right.t_cam_body, np.array(t) - [BASELINE, 0, 0], atol=EXACT)
        np.testing.assert_allclose(T_left_wide @ wide.T_cam_body, left.T_cam_body, atol=EXACT)
        rig = wide.record["rig"]
        np.testing.assert_allclose(rig["t_first_cam"], PLACE, atol=EXACT)
        np.testing.assert_allclose(rig["q_first_cam"], ASIDE, atol=EXACT)


def test_disparity_of_the_pair_is_focal_length_and_baseline_over_depth(dataset) -> None:
    for picture, sign in ((dataset.picture("p0"), 1), (dataset.picture("p0", "nominal-right"), -1)):
        shown = picture.depth > 0
        assert shown.sum() > 300
        left, up, state = np.moveaxis(picture.label("disparity")[shown], -1, 0)
        wanted = sign * picture.camera.fx * BASELINE / picture.depth[shown].astype(np.float64)
        np.testing.assert_allclose(left, wanted, rtol=FLOAT32)
        assert np.abs(up).max() < FLOAT32 * picture.camera.fy
        assert set(np.unique(state)) <= {1, 2, 3}


def test_disparity_leads_to_the_same_point_in_the_paired_picture(dataset) -> None:
    """Of a camera that is turned, too: where it says that the point is seen there."""
    for variant in dataset.variants:
        picture = dataset.picture("p0", variant)
        other = dataset.picture("p0", picture.record["paired"]["variant"])
        rows, columns = np.nonzero(picture.depth)
        left, up, state = picture.label("disparity")[rows, columns].T
        there = np.floor([columns + 0.5 - left, rows + 0.5 - up]).astype(int)[:, state == 1]
        assert there.shape[1] > 50
        seen = other.dense_pose[there[1], there[0]]
        apart = np.linalg.norm(seen - picture.dense_pose[rows, columns][state == 1], axis=1)
        met = other.depth[there[1], there[0]]  # 0 where the pixel's centre, beside the point, shows the background
        pixels = apart[met > 0] / (met[met > 0] / min(other.camera.fx, other.camera.fy))
        assert np.mean(met > 0) > 0.9
        assert np.median(pixels) < 1
        assert np.mean(pixels < 10) > 0.95  # but for pixels whose centre shows another face


def test_check_and_the_independent_oracle_accept_it(rendered, shared, spin_usd) -> None:
    assert "0 errors" in spin_usd("check", rendered).stdout
    done = subprocess.run(
        [sys.executable, shared / "check" / "oracle.py", rendered], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_range_finder_says_how_far_the_surface_is_ahead(dataset) -> None:
    """A quarter of a metre behind the first camera: as its depth there says, from wherever a camera stands."""
    left = dataset.picture("p0")
    said = left.record["range_finder"]
    here = left.depth[35:37, 47:49]  # around the principal point
    assert here.min() - 0.02 < said["range"] - 0.25 < here.max() + 0.02
    assert said["nearest"] <= said["range"]
    assert said["share"] == 1
    wide = dataset.picture("p0", "nominal-wide").record
    assert wide["range_finder"]["range"] == pytest.approx(said["range"], abs=EXACT)
    rig = wide["rig"]
    T_first_cam = Transform.from_quaternion(to="first", of="cam", q=rig["q_first_cam"], t=rig["t_first_cam"])
    np.testing.assert_allclose(T_first_cam.points(wide["range_finder"]["origin"]), [0, 0, -0.25], atol=EXACT)
    np.testing.assert_allclose(T_first_cam.directions(wide["range_finder"]["direction"]), [0, 0, 1], atol=EXACT)


def test_a_picture_finds_the_others_of_its_frame(dataset) -> None:
    left = dataset.picture("p0")
    wide = left.seen_by("wide")
    assert wide == dataset.picture("p0", "nominal-wide")
    assert wide.seen_by("left") == left
    with pytest.raises(InputError, match="p0 has no picture by the camera 'rear'"):
        left.seen_by("rear")


def test_each_picture_has_a_stage_hash_and_noise_of_its_own(dataset) -> None:
    provenance = [dataset.picture("p0", variant).record["provenance"] for variant in dataset.variants]
    assert len({each["stage"]["hash"] for each in provenance}) == 3
    assert len({each["seed"]["picture"] for each in provenance}) == 3


def test_the_stage_is_one_that_usd_renders_with_each_camera(stage) -> None:
    """Each further camera is that of its own products, with its resolution, and below the first."""
    reader = StageReader(stage / "dataset.usda", variant="nominal-wide")
    assert not [finding for finding in check_stage(stage / "dataset.usda") if finding.severity == "error"]
    product = reader.stage.GetPrimAtPath("/Render/Products/wide_depth")
    assert product.GetRelationship("camera").GetTargets() == [reader.camera_prim.GetPath()]
    assert tuple(product.GetAttribute("resolution").Get()) == (64, 64)
    assert reader.camera_path == "/World/Camera/Camera_wide"


def test_an_augmentation_of_the_exposure_is_that_of_all_cameras(stage, tmp_path, spin_usd) -> None:
    spec = tmp_path / "bright.toml"
    spec.write_text(BRIGHT)
    spin_usd("augment", stage, "--spec", spec, "--out", stage / "bright.usda")
    for camera in ("", "-right", "-wide"):
        reader = StageReader(stage / "bright.usda", variant=f"bright{camera}")
        assert reader.camera_prim.GetAttribute("exposure:iso").Get() == 700


@pytest.mark.parametrize(
    ("cameras", "said"),
    [
        (("speedplus", "speedplus"), "is a further camera without a pose"),
        (("speedplus", "speedplus:"), "the pose after ':' is empty"),
        (("speedplus", "speedplus:1,0"), "'1,0' is neither a pose nor a file"),
        (("speedplus", "speedplus:1,0,x"), "contains text that is not a number"),
        (("speedplus", "speedplus:2,0,0,0,1,0,0"), "its quaternion has norm 2"),
        (("speedplus", "speedplus:nan,0,0"), "nan"),
        (("speedplus", "a=speedplus:1,0,0", "a=speedplus:2,0,0"), "two cameras are called 'a'"),
        (("speedplus", "A b=speedplus:1,0,0"), "'A b' cannot name a camera"),
    ],
)
def test_cameras_that_do_not_say_where_they_stand_are_refused(cameras, said, tmp_path) -> None:
    with pytest.raises(InputError, match=said):
        author(sample="range=5..8 count=1", target="cubesat", camera=cameras, out=tmp_path / "stage")


def test_a_label_of_two_cameras_is_refused_where_there_is_one(tmp_path, spin_usd) -> None:
    one = author(sample="range=5..8 count=1", target="cubesat", camera="speedplus", out=tmp_path / "stage").root
    asked = ("render", one, "--out", tmp_path / "out", "--labels-only", "--labels", "disparity")
    done = spin_usd(*asked, code=2)
    assert "has no second camera, which the label disparity needs" in done.stderr
